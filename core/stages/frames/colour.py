# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Video signals to the sRGB a phone would show: HLG and PQ (ITU-R BT.2100) on a display of 1000 nits, wide gamuts.

Dolby Vision 8.4, as iPhones record it, is HLG with metadata beside it and is read as HLG. Reference white, 203 nits
(BT.2408), is 1.0 of linear light before the tone curve, so that an HDR video of a face gives the skin the tone an SDR
one would.
"""

from __future__ import annotations

import numpy as np

from ...imaging import images

SDR, HLG, PQ = 1, 18, 16
"""Transfer characteristics by ITU-T H.273; everything but HLG and PQ is taken as SDR."""
REC709, REC2020, P3 = 1, 9, 12
"""Colour primaries by ITU-T H.273; P3 is Display P3."""
COMPACT_SRGB = ("c2", "c2ci")
"""Names of small sRGB profiles, as social networks write them."""
WHITE_NITS, PEAK_NITS = 203.0, 1000.0
KNEE_LINEAR = 0.8
"""The tone curve changes nothing below: all of a face but its highlights."""
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # of linear Rec. 709 (ITU-R BT.709)
LUMINANCE_2020 = np.array([0.2627, 0.6780, 0.0593], np.float32)  # of linear Rec. 2020 (ITU-R BT.2020)
TO_REC709 = {
    REC2020: np.array(
        [[1.660491, -0.587641, -0.072850], [-0.124550, 1.132900, -0.008349], [-0.018151, -0.100579, 1.118730]],
        np.float32,
    ),
    P3: np.array(
        [[1.224940, -0.224940, 0.0], [-0.042057, 1.042057, 0.0], [-0.019638, -0.078636, 1.098274]], np.float32
    ),
}

ADOBE_GAMMA = 563 / 256
ADOBE_TO_REC709 = np.array([[1.398356, -0.398356, 0.0], [0.0, 1.0, 0.0], [0.0, -0.042929, 1.042929]], np.float32)
"""Adobe RGB (1998), Adobe Systems, 2005: its exponent, and its primaries, whose white is sRGB's."""


def from_profile(signal: np.ndarray, profile: str) -> np.ndarray | None:
    """Convert values [..., 3] in [0, 1] to sRGB by the name of their colour profile ('' is sRGB).

    None for an unknown profile.
    """
    name = profile.lower().replace(" ", "")
    if not name or "srgb" in name or name in COMPACT_SRGB:
        return signal
    if "displayp3" in name:  # an iPhone's JPEG
        return to_srgb(signal, SDR, P3)
    if "adobergb" in name:
        return images.linear_to_srgb(into_gamut(np.clip(signal, 0, 1) ** ADOBE_GAMMA @ ADOBE_TO_REC709.T))
    return None


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


def into_gamut(light: np.ndarray) -> np.ndarray:
    """Mix linear Rec. 709 light with grey of its luminance, just so far that no part is negative."""
    luminance = np.maximum(light @ LUMINANCE, 0)[..., None]
    least = light.min(-1, keepdims=True)
    keep = np.where(least < 0, luminance / np.maximum(luminance - least, 1e-9), 1)
    return np.maximum(luminance + (light - luminance) * keep, 0)


def tone_curve(light: np.ndarray) -> np.ndarray:
    """Compress display light [..., 3] to [0, 1): identity up to KNEE_LINEAR, then a hyperbola of the same slope.

    It works on the largest channel and scales the others with it, so that hues stay. Reference white becomes 0.9, 1000
    nits 0.99.
    """
    peak = light.max(-1, keepdims=True)
    over = np.maximum(peak - KNEE_LINEAR, 0) / (1 - KNEE_LINEAR)
    return light * np.where(over > 0, (KNEE_LINEAR + (1 - KNEE_LINEAR) * over / (1 + over)) / np.maximum(peak, 1e-9), 1)
