# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Log footage: the curves and gamuts that cameras record by, which of them a file names, and their decoding to sRGB.

A curve takes the R'G'B' signal in [0, 1] to scene light in which a white card is near 1 and a grey card 0.18. H.273 has
no number for any of them, so a file names its curve in its maker's own metadata, or not at all.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...imaging import images
from .colour import REC709, TO_REC709, into_gamut, matrix_to_rec709, tone_curve

RECORDED, LINEAR = "recorded", "linear"
"""Choices of the setting Colour beside the curves: what the file says, and light itself."""
Points = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
"""Chromaticities (x, y) of red, green and blue; the white is D65."""


@dataclass(frozen=True)
class LogCurve:
    """A camera's way to record: its name, the gamut's primaries, and the light of a signal [...]."""

    title: str
    primaries: Points
    light: Callable[[np.ndarray], np.ndarray]


def apple_log_light(signal: np.ndarray) -> np.ndarray:
    """Decode Apple Log (Apple, Apple Log Profile White Paper, 2023)."""
    start, join, c, beta, gamma, delta = -0.05641088, 0.01, 47.28711236, 0.00964052, 0.08550479, 0.69336945
    joined = c * (join - start) ** 2
    low = np.sqrt(np.maximum(signal, 0) / c) + start
    return np.where(signal < joined, low, 2 ** ((np.maximum(signal, joined) - delta) / gamma) - beta)


def s_log3_light(signal: np.ndarray) -> np.ndarray:
    """Decode S-Log3 (Sony, Technical Summary for S-Gamut3.Cine/S-Log3 and S-Gamut3/S-Log3)."""
    code, joined = signal * 1023, 171.2102946929
    low = (code - 95) * 0.01125 / (joined - 95)
    return np.where(code < joined, low, 10 ** ((np.maximum(code, joined) - 420) / 261.5) * (0.18 + 0.01) - 0.01)


def v_log_light(signal: np.ndarray) -> np.ndarray:
    """Decode V-Log (Panasonic, V-Log/V-Gamut Reference Manual, 2014)."""
    joined, b, c, d = 0.181, 0.00873, 0.241514, 0.598206
    return np.where(signal < joined, (signal - 0.125) / 5.6, 10 ** ((np.maximum(signal, joined) - d) / c) - b)


CURVES = {
    "apple_log": LogCurve("Apple Log", ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046)), apple_log_light),
    "s_log3": LogCurve("S-Log3, S-Gamut3.Cine", ((0.766, 0.275), (0.225, 0.800), (0.089, -0.087)), s_log3_light),
    "s_log3_s_gamut3": LogCurve("S-Log3, S-Gamut3", ((0.730, 0.280), (0.140, 0.855), (0.100, -0.050)), s_log3_light),
    "v_log": LogCurve("V-Log", ((0.730, 0.280), (0.165, 0.840), (0.100, -0.030)), v_log_light),
}
"""Name -> curve; all but s_log3_s_gamut3, which only files name, are choices of the setting Colour."""
NAMED = (
    (re.compile(rb"com\.apple\.rec2020\.apple-log(?![\w-])"), "apple_log"),  # not Apple Log 2, of another gamut
    (re.compile(rb"<(?:\w+:)?CaptureGamma>\s*V-Log(?:L| L)?\s*<", re.IGNORECASE), "v_log"),
    (re.compile(rb'CaptureGammaEquation"?\s+value="s-log3', re.IGNORECASE), "s_log3"),
)
"""What makers write: Apple in the sample description and the film's own tags, Panasonic and Sony in XML."""
WIDER = re.compile(rb'CaptureColorPrimaries"?\s+value="s-gamut3"', re.IGNORECASE)
BOXES = (b"moov", b"meta", b"uuid", b"udta")
"""Boxes of an MP4 or MOV that hold metadata, and the most that is read of each."""
MOST_BYTES = 8 << 20


def recorded_curve(path: Path, *tags: Mapping[str, str]) -> str | None:
    """Return the name of the curve that a film's file names in FFmpeg's `tags` or in its own boxes, or None."""
    texts = [" ".join(f"{name}={value}" for each in tags for name, value in each.items()).encode()]
    texts += _boxes(path)
    for pattern, name in NAMED:
        if any(pattern.search(text) for text in texts):
            wide = name == "s_log3" and any(WIDER.search(text) for text in texts)
            return "s_log3_s_gamut3" if wide else name
    return None


def decode(signal: np.ndarray, colour: str, primaries: int = REC709) -> np.ndarray:
    """Convert a full-range R'G'B' signal float32 [..., 3] in [0, 1] to sRGB float32, by a choice of the setting Colour.

    `primaries` are those of linear light, by H.273's number; a curve has its own.
    """
    if colour == LINEAR:
        light = signal @ TO_REC709[primaries].T if primaries in TO_REC709 else signal
        return images.linear_to_srgb(np.clip(into_gamut(light), 0, 1))
    curve = CURVES[colour]
    light = curve.light(signal.astype(np.float64)) @ matrix_to_rec709(*curve.primaries).T
    return images.linear_to_srgb(tone_curve(into_gamut(light.astype(np.float32))))


def _boxes(path: Path) -> list[bytes]:
    """Return the metadata of an MP4's or MOV's top-level boxes; of another file nothing."""
    found, end = [], path.stat().st_size
    with open(path, "rb") as file:
        at = 0
        while at + 8 <= end:
            file.seek(at)
            head = file.read(16)
            size, kind = int.from_bytes(head[:4], "big"), head[4:8]
            if size == 1:
                size = int.from_bytes(head[8:], "big")
            elif size == 0:
                size = end - at
            if size < 8 or not kind.isalnum():
                break
            if kind in BOXES:
                file.seek(at)
                found.append(file.read(min(size, MOST_BYTES)))
            at += size
    return found
