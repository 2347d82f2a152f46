# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scores of skin, brows, lips and beard apart: a mean over a face is a mean over its skin.

All parts share the one gain per channel of the whole face: a brow that is bleached is an error, not a tone.
"""

from dataclasses import dataclass

import numpy as np

from .shared_light import log_ratio
from .tone import squared_error, to_decibels, to_tone

LEAST_TEXELS = 100


@dataclass(frozen=True)
class PartScore:
    """PSNR in dB (sRGB), median and deviation of the grey log(answer / truth) of a part, and its texels."""

    psnr: float
    bias: float
    deviation: float
    texels: int


def score_parts(answer: np.ndarray, truth: np.ndarray, regions: dict[str, np.ndarray]) -> dict[str, PartScore]:
    """Score linear colours of the face's texels [N, 3] in regions, bool [N]; small parts are left out."""
    toned = to_tone(answer, truth.mean(0))
    ratio = log_ratio(toned, truth)
    return {
        name: PartScore(
            to_decibels(squared_error(toned[where], truth[where])),
            float(np.median(ratio[where])),
            float(ratio[where].std()),
            int(where.sum()),
        )
        for name, where in regions.items()
        if where.sum() >= LEAST_TEXELS
    }
