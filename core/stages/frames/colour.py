# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Video signals to the sRGB a phone would show: HLG and PQ (ITU-R BT.2100) on a display of 1000 nits, wide gamuts.

Dolby Vision 8.4, as iPhones record it, is HLG with metadata beside it and is read as HLG. Reference white, 203 nits
(BT.2408), is 1.0 of linear light before the tone curve, so that an HDR video of a face gives the skin the tone an SDR
one would.
"""

from __future__ import annotations

import numpy as np

from ...imaging import colours, images
from ...imaging.colours import Colour, into_gamut

SDR, HLG, PQ = 1, 18, 16
"""Transfer characteristics by ITU-T H.273; everything but HLG and PQ is taken as SDR."""
REC709, REC2020, P3 = 1, 9, 12
"""Colour primaries by ITU-T H.273; P3 is Display P3."""
WHITE_NITS, PEAK_NITS = 203.0, 1000.0
KNEE_LINEAR = 0.8
"""The tone curve changes nothing below: all of a face but its highlights."""
LUMINANCE_2020 = np.array([0.2627, 0.6780, 0.0593], np.float32)  # of linear Rec. 2020 (ITU-R BT.2020)


def matrix_to_rec709(red: tuple, green: tuple, blue: tuple) -> np.ndarray:
    """Return the matrix [3, 3] from linear light of primaries at these (x, y), and a white of D65, to Rec. 709's."""
    return np.linalg.inv(_to_xyz(*REC709_POINTS)) @ _to_xyz(red, green, blue)


def _to_xyz(*points: tuple[float, float]) -> np.ndarray:
    """Return the matrix [3, 3] to CIE XYZ in which white (1, 1, 1) is D65 (SMPTE RP 177)."""
    columns = np.array([(x / y, 1.0, (1 - x - y) / y) for x, y in (*points, D65)]).T
    return columns[:, :3] * np.linalg.solve(columns[:, :3], columns[:, 3])


REC709_POINTS, D65 = ((0.640, 0.330), (0.300, 0.600), (0.150, 0.060)), (0.3127, 0.3290)
TO_REC709 = {
    REC2020: matrix_to_rec709((0.708, 0.292), (0.170, 0.797), (0.131, 0.046)).astype(np.float32),
    P3: matrix_to_rec709((0.680, 0.320), (0.265, 0.690), (0.150, 0.060)).astype(np.float32),
}


def from_stated(signal: np.ndarray, colour: Colour) -> np.ndarray:
    """Convert a photograph's stored values [..., 3] to sRGB; HDR as a video's."""
    transfer = {colours.HLG: HLG, colours.PQ: PQ}.get(colour.curve) if isinstance(colour.curve, str) else None
    return colour.to_srgb(signal) if transfer is None else to_srgb(signal, transfer, colour.primaries)


def to_srgb(signal: np.ndarray, transfer: int, primaries: int) -> np.ndarray:
    """Convert a full-range R'G'B' signal float32 [..., 3] in [0, 1] to sRGB float32 in [0, 1].

    `transfer` and `primaries` are H.273's numbers. HDR with unstated primaries is Rec. 2020, as BT.2100 has it.
    """
    if transfer not in (HLG, PQ):
        if primaries not in TO_REC709:
            return signal
        return images.linear_to_srgb(into_gamut(images.srgb_to_linear(signal) @ TO_REC709[primaries].T))
    light = hlg_light(signal) if transfer == HLG else pq_light(signal)
    if primaries != REC709:
        light = light @ TO_REC709.get(primaries, TO_REC709[REC2020]).T
    return images.linear_to_srgb(tone_curve(into_gamut(light)))


def hlg_light(signal: np.ndarray) -> np.ndarray:
    """Convert HLG to display light, 1.0 at reference white: inverse OETF, then the OOTF (BT.2100, table 5)."""
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    scene = np.where(signal <= 0.5, signal**2 / 3, (np.exp((np.maximum(signal, 0.5) - c) / a) + b) / 12)
    luminance = np.maximum(scene @ LUMINANCE_2020, 0)[..., None]
    return (PEAK_NITS / WHITE_NITS) * luminance**0.2 * scene


def pq_light(signal: np.ndarray) -> np.ndarray:
    """Convert PQ to display light, 1.0 at reference white: the EOTF (BT.2100, table 4; SMPTE ST 2084)."""
    root = np.maximum(signal, 0) ** (1 / 78.84375)
    linear = (np.maximum(root - 0.8359375, 0) / (18.8515625 - 18.6875 * root)) ** (1 / 0.1593017578125)
    return linear * (10000 / WHITE_NITS)


def tone_curve(light: np.ndarray) -> np.ndarray:
    """Compress display light [..., 3] to [0, 1): identity up to KNEE_LINEAR, then a hyperbola of the same slope.

    It works on the largest channel and scales the others with it, so that hues stay. Reference white becomes 0.9, 1000
    nits 0.99.
    """
    peak = light.max(-1, keepdims=True)
    over = np.maximum(peak - KNEE_LINEAR, 0) / (1 - KNEE_LINEAR)
    return light * np.where(over > 0, (KNEE_LINEAR + (1 - KNEE_LINEAR) * over / (1 + over)) / np.maximum(peak, 1e-9), 1)
