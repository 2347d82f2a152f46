# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour encoding of pictures as their files state it: EXR chromaticities, PNG chunks, ICC profiles, H.273 numbers.

A file that states nothing is sRGB, or linear Rec. 709 if it stores floats.
"""

from __future__ import annotations

import math
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SRGB, LINEAR, HLG, PQ = "sRGB", "linear", "HLG", "PQ"
D65, D50, ACES_WHITE, DCI_WHITE = (0.3127, 0.3290), (0.34567, 0.35850), (0.32168, 0.33767), (0.314, 0.351)
REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, *D65)
REC2020 = (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, *D65)
DISPLAY_P3 = (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, *D65)
ADOBE = (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, *D65)
ACESCG = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, *ACES_WHITE)
ACES = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, *ACES_WHITE)
"""Chromaticities x, y of red, green, blue and white: ITU-R BT.709, BT.2020, SMPTE EG 432-1, Adobe RGB (1998), SMPTE ST
2065-1 and AMPAS S-2014-004."""
PRIMARIES = {1: REC709, 9: REC2020, 11: (*DISPLAY_P3[:6], *DCI_WHITE), 12: DISPLAY_P3}
NUMBER_OF = {REC709: 1, REC2020: 9, DISPLAY_P3: 12}
"""H.273's numbers of colour primaries."""
TRANSFERS = {4: 2.2, 5: 2.8, 8: LINEAR, 16: PQ, 18: HLG}
"""H.273's transfer characteristics that are not a display's usual ones, which count as sRGB."""
SPACES = {
    "lin_rec709_scene": REC709,
    "lin_rec709": REC709,
    "acescg": ACESCG,
    "lin_ap1_scene": ACESCG,
    "lin_ap1": ACESCG,
    "aces2065-1": ACES,
    "lin_ap0_scene": ACES,
    "lin_rec2020_scene": REC2020,
    "lin_p3d65_scene": DISPLAY_P3,
    "lin_adobergb_scene": ADOBE,
}
"""Names of linear colour spaces in an EXR (OpenColorIO's, and the ASWF's interop IDs) that has no chromaticities."""
PROFILES = {"displayp3": (SRGB, DISPLAY_P3), "adobergb": (563 / 256, ADOBE)}
"""Profiles that are told by their names, where a picture has no more of them."""
SRGB_NAMES = ("srgb", "c2", "c2ci")
"""Names of sRGB profiles; the last two are small ones, as social networks write them."""
SRGB_GAMMA, GAMMA_SLACK = 1 / 2.2, 0.01
"""What PNG encoders write beside sRGB values; the curves differ by two codes at most above the blacks."""
LEAST_GAMMA, MOST_GAMMA = 0.25, 1.5
"""Exponents that a PNG can have been encoded with."""
SAME_PRIMARIES = 0.002
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
"""XYZ to the cone space in which a white is adapted (ICC.1:2022, annex E)."""
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # of linear Rec. 709 (ITU-R BT.709)
CURVE_POINTS = 4096


@dataclass(frozen=True)
class Colour:
    """Encoding of stored R, G, B.

    curve: SRGB, LINEAR, HLG, PQ, an exponent, or a table [3, N] of light over evenly spaced values in [0, 1]; matrix
    [3, 3] to linear Rec. 709, None for its own primaries; primaries: H.273's number, for HLG and PQ; unknown: name of a
    profile that cannot be read, whose values are taken for sRGB; assumed: floats that do not state their primaries.
    """

    curve: str | float | np.ndarray = SRGB
    matrix: np.ndarray | None = None
    primaries: int = 1
    unknown: str = ""
    assumed: bool = False

    def to_linear(self, stored: np.ndarray) -> np.ndarray:
        """Convert stored values float32 [..., 3] to linear Rec. 709; HLG and PQ are taken for sRGB."""
        if isinstance(self.curve, np.ndarray):
            places = np.linspace(0, 1, self.curve.shape[1])
            light = np.stack([np.interp(stored[..., i], places, self.curve[i]) for i in range(3)], -1)
        elif isinstance(self.curve, float):
            light = np.clip(stored, 0, None) ** self.curve
        else:
            light = stored if self.curve == LINEAR else srgb_to_linear(stored)
        return np.asarray(light if self.matrix is None else into_gamut(light @ self.matrix.T), np.float32)

    def to_srgb(self, stored: np.ndarray) -> np.ndarray:
        """Convert stored values float32 [..., 3] to sRGB; all but sRGB itself is clipped. HLG and PQ as above."""
        plain = isinstance(self.curve, str) and self.curve != LINEAR and self.matrix is None
        return stored if plain else linear_to_srgb(self.to_linear(stored))


def srgb_to_linear(srgb: np.ndarray) -> np.ndarray:
    """Decode sRGB, any shape; negative values stay negative."""
    srgb = np.asarray(srgb, np.float32)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((np.maximum(srgb, 0) + 0.055) / 1.055) ** 2.4).astype(np.float32)


def linear_to_srgb(linear: np.ndarray) -> np.ndarray:
    """Encode linear values as sRGB, any shape, clipped to [0, 1]."""
    linear = np.clip(np.asarray(linear, np.float32), 0, 1)
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055).astype(np.float32)


def into_gamut(light: np.ndarray) -> np.ndarray:
    """Mix linear Rec. 709 light with grey of its luminance, just so far that no part is negative."""
    luminance = np.maximum(light @ LUMINANCE, 0)[..., None]
    least = light.min(-1, keepdims=True)
    keep = np.where(least < 0, luminance / np.maximum(luminance - least, 1e-9), 1)
    return np.maximum(luminance + (light - luminance) * keep, 0)


def of_exr(chromaticities: tuple | None, *names: str | None) -> Colour:
    """Return the colour of linear floats by their chromaticities [8], or else by the names that the file gives."""
    if chromaticities is not None and len(chromaticities) == 8:
        return Colour(LINEAR, to_rec709(tuple(map(float, chromaticities))))
    spaces = [SPACES[name.lower()] for name in names if name and name.lower() in SPACES]
    return Colour(LINEAR, to_rec709(spaces[0])) if spaces else Colour(LINEAR, assumed=True)


def of_numbers(primaries: int, transfer: int) -> Colour:
    """Return the colour that ITU-T H.273's numbers state, as in a PNG's cICP chunk and a HEIF's nclx box."""
    curve = TRANSFERS.get(transfer, SRGB)
    return Colour(curve, to_rec709(PRIMARIES.get(primaries, REC709)), primaries)


def of_png(path: Path) -> Colour:
    """Return the colour that a PNG states: cICP, else its profile, else sRGB, else gAMA and cHRM (W3C PNG, 4.3)."""
    chunks = _png_chunks(path)
    if len(numbers := chunks.get(b"cICP", b"")) == 4:
        return of_numbers(numbers[0], numbers[1])
    if profile := chunks.get(b"iCCP"):
        try:
            return of_profile(zlib.decompressobj().decompress(profile.split(b"\0", 1)[1][1:], 1 << 24))
        except (zlib.error, IndexError):
            return Colour()
    if b"sRGB" in chunks or not {b"gAMA", b"cHRM"} & chunks.keys():
        return Colour()
    gamma = int.from_bytes(chunks.get(b"gAMA", b""), "big") / 1e5
    curve = SRGB
    if abs(gamma - 1) < GAMMA_SLACK:
        curve = LINEAR
    elif LEAST_GAMMA < gamma < MOST_GAMMA and abs(gamma - SRGB_GAMMA) > GAMMA_SLACK:
        curve = 1 / gamma
    corners = chunks.get(b"cHRM", b"")
    if len(corners) != 32:
        return Colour(curve)
    white, *colours = [(x / 1e5, y / 1e5) for x, y in struct.iter_unpack(">2I", corners)]
    return Colour(curve, to_rec709((*(c for pair in colours for c in pair), *white)))


def of_profile(icc: bytes) -> Colour:
    """Return the colour of an ICC profile: by its curves and matrix, else by its name (ICC.1:2022)."""
    tags = _icc_tags(icc)
    name = _icc_text(tags.get(b"desc", b""))
    plain = name.lower().replace(" ", "")
    if not tags or "srgb" in plain or plain in SRGB_NAMES:
        return Colour()
    columns = [_icc_xyz(tags.get(kind, b"")) for kind in (b"rXYZ", b"gXYZ", b"bXYZ")]
    curves = [_icc_curve(tags.get(kind, b"")) for kind in (b"rTRC", b"gTRC", b"bTRC")]
    if all(column is not None for column in columns) and all(curve is not None for curve in curves):
        matrix = np.linalg.inv(adapted(D65, D50) @ to_xyz(REC709)) @ np.array(columns).T
        return Colour(_simplest(np.array(curves)), None if np.abs(matrix - np.eye(3)).max() < 0.005 else _float(matrix))
    if (grey := _icc_curve(tags.get(b"kTRC", b""))) is not None:
        return Colour(_simplest(np.array([grey] * 3)))
    return of_name(name)


def of_name(name: str) -> Colour:
    """Return the colour of a profile of which only the name is to be had."""
    plain = name.lower().replace(" ", "")
    if not plain or "srgb" in plain or plain in SRGB_NAMES:
        return Colour()
    for words, (curve, primaries) in PROFILES.items():
        if words in plain:
            return Colour(curve, to_rec709(primaries), NUMBER_OF.get(primaries, 1))
    return Colour(unknown=name)


def to_rec709(corners: tuple) -> np.ndarray | None:
    """Return the matrix float32 [3, 3] from linear values of these chromaticities to Rec. 709, whites adapted.

    None if they are Rec. 709's, or cannot be a colour space's.
    """
    if not all(map(math.isfinite, corners)) or np.abs(np.subtract(corners, REC709)).max() < SAME_PRIMARIES:
        return None
    area = (corners[2] - corners[0]) * (corners[5] - corners[1]) - (corners[4] - corners[0]) * (corners[3] - corners[1])
    if min(corners[1], corners[3], corners[7]) <= 0 or corners[5] == 0 or abs(area) < 0.01:
        return None
    return _float(np.linalg.inv(to_xyz(REC709)) @ adapted(corners[6:], D65) @ to_xyz(corners))


def to_xyz(corners: tuple) -> np.ndarray:
    """Return the matrix [3, 3] from linear R, G, B to XYZ, their own white at Y = 1 (SMPTE RP 177)."""
    x, y = np.array(corners, np.float64).reshape(4, 2).T
    xyz = np.stack([x / y, np.ones(4), (1 - x - y) / y])
    return xyz[:, :3] * np.linalg.solve(xyz[:, :3], xyz[:, 3])


def adapted(white: tuple, to: tuple) -> np.ndarray:
    """Return the matrix [3, 3] of XYZ that brings one white, x and y, to another."""
    cones = [BRADFORD @ [x / y, 1, (1 - x - y) / y] for x, y in (white, to)]
    return np.linalg.inv(BRADFORD) @ np.diag(cones[1] / cones[0]) @ BRADFORD


def _float(matrix: np.ndarray) -> np.ndarray:
    return matrix.astype(np.float32)


def _simplest(curves: np.ndarray) -> str | np.ndarray:
    """Return LINEAR or SRGB for tables [3, N] that are these, else the tables."""
    places = np.linspace(0, 1, curves.shape[1], dtype=np.float32)
    if np.abs(curves - places).max() < 1e-3:
        return LINEAR
    return SRGB if np.abs(curves - srgb_to_linear(places)).max() < 1e-3 else curves


def _png_chunks(path: Path) -> dict[bytes, bytes]:
    """Return the chunks before a PNG's pixels by their kinds."""
    chunks: dict[bytes, bytes] = {}
    with open(path, "rb") as file:
        file.seek(8)
        while len(head := file.read(8)) == 8:
            size, kind = struct.unpack(">I4s", head)
            if kind in (b"IDAT", b"IEND"):
                break
            if kind in (b"cICP", b"iCCP", b"sRGB", b"gAMA", b"cHRM"):
                chunks[kind] = file.read(size)
            else:
                file.seek(size, 1)
            file.seek(4, 1)
    return chunks


def _icc_tags(icc: bytes) -> dict[bytes, bytes]:
    tags = {}
    try:
        for i in range(min(struct.unpack_from(">I", icc, 128)[0], 200)):
            kind, at, size = struct.unpack_from(">4s2I", icc, 132 + 12 * i)
            tags[kind] = icc[at : at + size]
    except struct.error:
        pass
    return tags


def _icc_text(tag: bytes) -> str:
    if tag[:4] == b"desc":
        return tag[12 : 12 + int.from_bytes(tag[8:12], "big")].split(b"\0")[0].decode("latin-1")
    if tag[:4] == b"mluc" and len(tag) >= 28:
        size, at = struct.unpack_from(">2I", tag, 20)
        return tag[at : at + size].decode("utf-16-be", "replace").strip("\0")
    return ""


def _icc_xyz(tag: bytes) -> tuple | None:
    return tuple(value / 65536 for value in struct.unpack_from(">3i", tag, 8)) if len(tag) >= 20 else None


def _icc_curve(tag: bytes) -> np.ndarray | None:
    """Return light [CURVE_POINTS] over values in [0, 1] of a `curv` or `para` tag, None for another one."""
    x = np.linspace(0, 1, CURVE_POINTS)
    try:
        if tag[:4] == b"curv":
            count = struct.unpack_from(">I", tag, 8)[0]
            if count == 0:
                return x
            values = np.frombuffer(tag, ">u2", count, 12).astype(np.float64)
            return x ** (values[0] / 256) if count == 1 else np.interp(x, np.linspace(0, 1, count), values / 65535)
        if tag[:4] == b"para":
            function = struct.unpack_from(">H", tag, 8)[0]
            count = (1, 3, 4, 5, 7)[function]
            g, a, b, c, d, e, f = (*(v / 65536 for v in struct.unpack_from(f">{count}i", tag, 12)), *[0.0] * 7)[:7]
            if function == 0:
                return x**g
            power = np.maximum(a * x + b, 0) ** g
            if function in (1, 2):
                return np.where(x >= -b / a if a else False, power, 0) + (c if function == 2 else 0)
            return np.where(x >= d, power + (e if function == 4 else 0), c * x + (f if function == 4 else 0))
    except (struct.error, ValueError, IndexError):
        pass
    return None
