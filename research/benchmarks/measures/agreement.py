# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Agreement of the albedos of one head, answered from captures under different lights.

Each answer first gets the gain per channel that brings it to one tone, the truth's mean over the texels that all
captures see: exposures and white balances are not what is asked. A flat colour agrees perfectly, so agreement is read
beside error to truth and detail; and two registrations never agree perfectly, so the true map, filmed through the same
ones, says how well an answer can.
"""

from itertools import combinations

import numpy as np

from .tone import squared_error, to_decibels, to_tone


def disagreement(answers: list[np.ndarray], tone: np.ndarray) -> float | None:
    """Return the mean squared sRGB difference over all pairs of linear answers [N, 3]; None for fewer than two."""
    toned = [to_tone(answer, tone) for answer in answers]
    pairs = [squared_error(one, other) for one, other in combinations(toned, 2)]
    return float(np.mean(pairs)) if pairs else None


def agreement(answers: list[np.ndarray], tone: np.ndarray) -> float | None:
    """Return the agreement in dB (PSNR of the mean squared difference)."""
    found = disagreement(answers, tone)
    return None if found is None else to_decibels(found)
