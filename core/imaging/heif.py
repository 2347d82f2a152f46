# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""HEIC and HEIF, as phones write them, by libheif (package pillow-heif), which OpenImageIO's wheel lacks.

libheif turns pictures upright itself. Pillow, which the package brings along, is not used.
"""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np

from ..capture.messages import Problem

SUFFIXES = (".heic", ".heif")
EXPORT = "Export it as JPEG or PNG (on an iPhone: Settings, Camera, Formats, Most Compatible)."
# tags of EXIF 2.3
EXIF_FOLDER, FOCAL_LENGTH, FOCAL_35MM = 0x8769, 0x920A, 0xA405
PLANE_RESOLUTION, PLANE_UNIT, WIDTH, HEIGHT = 0xA20E, 0xA210, 0xA002, 0xA003
DIAGONAL_35MM = 43.267
"""Of a frame of 35 mm film, 36 x 24 mm; pictures of other shapes are compared by their diagonal (CIPA DCG-001)."""
PROFILES = ("Display P3", "Adobe RGB", "ProPhoto RGB")
UNREADABLE = ValueError, EOFError, SyntaxError, RuntimeError, OSError
"""Raised by pillow-heif for damaged files."""


def is_heif(path: Path) -> bool:
    return Path(path).suffix.lower() in SUFFIXES


def read_pixels(path: Path, most_bytes: int) -> np.ndarray:
    """Return the upright picture as stored, float32 [H, W, C] in [0, 1].

    Raises Problem for a file that cannot be read or needs more than `most_bytes`.
    """
    picture = _open(path)
    width, height = picture.size
    if 12 * width * height > most_bytes:
        raise Problem(
            f"{path} is too large: {width} x {height} pixels need more than {most_bytes >> 30} GB of memory.",
            "Scale it down.",
        )
    try:
        pixels = np.asarray(picture)
    except UNREADABLE as error:
        raise _unreadable(path, error) from error
    return np.ascontiguousarray(np.atleast_3d(pixels), np.float32) / np.iinfo(pixels.dtype).max


def size(path: Path) -> tuple[int, int]:
    return _open(path).size


def read_profile(path: Path) -> str:
    """Return the picture's colour profile if it is not sRGB (one of PROFILES, "PQ" or "HLG"), else ""."""
    info = _open(path).info
    icc, nclx = info.get("icc_profile") or b"", info.get("nclx_profile") or {}
    if icc:
        return next((name for name in PROFILES if name.encode() in icc or name.encode("utf-16-be") in icc), "")
    hdr = {16: "PQ", 18: "HLG"}.get(nclx.get("transfer_characteristics"), "")
    return hdr or ("Display P3" if nclx.get("color_primaries") == 12 else "")


def read_exif(path: Path) -> dict[int, float]:
    """Return the EXIF numbers of a picture by their tags."""
    return parse_exif(_open(path).info.get("exif") or b"")


def parse_exif(block: bytes) -> dict[int, float]:
    """Return tag -> number of the first EXIF folder and of EXIF's own; damaged parts are skipped."""
    start = 6 if block.startswith(b"Exif\0\0") else 0
    order = {b"II": "<", b"MM": ">"}.get(block[start : start + 2])
    tags: dict[int, float] = {}
    try:
        folders = [struct.unpack_from(order + "I", block, start + 4)[0]] if order else []
        for at in folders:  # EXIF's own folder is appended on the way
            for i in range(struct.unpack_from(order + "H", block, start + at)[0]):
                tag, kind, count, value = struct.unpack_from(order + "HHII", block, start + at + 2 + 12 * i)
                if tag == EXIF_FOLDER and len(folders) == 1:
                    folders.append(value)
                elif kind == 3 and count == 1:
                    tags[tag] = float(struct.unpack_from(order + "H", block, start + at + 10 + 12 * i)[0])
                elif kind == 4 and count == 1:
                    tags[tag] = float(value)
                elif kind == 5 and count == 1:
                    above, below = struct.unpack_from(order + "II", block, start + value)
                    tags[tag] = above / below if below else 0.0
    except struct.error:
        pass
    return tags


def focal_35mm(tags: dict[int, float], width: int, height: int) -> float | None:
    """Return the focal length in mm of 35 mm film, by the diagonal, or None if EXIF does not tell it.

    It is stated, or follows from the lens and the sensor's resolution. width, height: the picture's.
    """
    if tags.get(FOCAL_35MM, 0) > 0:
        return tags[FOCAL_35MM]
    unit = {2: 25.4, 3: 10.0, 4: 1.0}.get(int(tags.get(PLANE_UNIT, 2)))
    if not unit or min(tags.get(FOCAL_LENGTH, 0), tags.get(PLANE_RESOLUTION, 0)) <= 0:
        return None
    sensor_mm = max(tags.get(WIDTH, width), tags.get(HEIGHT, height)) / tags[PLANE_RESOLUTION] * unit
    diagonal_mm = sensor_mm * math.hypot(width, height) / max(width, height)
    return DIAGONAL_35MM * tags[FOCAL_LENGTH] / diagonal_mm if 1 < sensor_mm < 100 else None


def _open(path: Path):
    try:
        import pillow_heif
    except ImportError as error:
        raise Problem(
            f"{Path(path).name} is a HEIC picture, and the package pillow-heif, which reads them, is not installed.",
            "Click Install Solver under Setup, or export the pictures as JPEG.",
        ) from error
    try:
        return pillow_heif.open_heif(path, convert_hdr_to_8bit=False)
    except UNREADABLE as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> Problem:
    return Problem(f"{path} is not a readable picture ({str(error).rstrip('.') or type(error).__name__}).", EXPORT)
