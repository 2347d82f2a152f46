# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Confidence of each texel of the solved albedo: how small its error is expected to be.

Four errors are taken for independent, so their variances add up: light of the whole face that is taken for skin, which
no place is free of; edges of the skin that the frames' registration blurs or moves, the larger the more the albedo
varies about a texel; a delighter's mistakes on brows, lips, hair and beards; and weak light, which it has to amplify.
Each was measured on people whose albedo is known, and judged on those who were left out
(research/benchmarks/maps/confidence.py).
"""

from __future__ import annotations

import cv2
import numpy as np

from ...solver.evidence import Evidence

# deviations in natural log: of light of the whole face; of edges, over the albedo's own deviation about a texel; of a
# texel whose colour says nothing of the light (Evidence.trust); of weak light, where it is as strong as usual
WHOLE_FACE, VARIED, UNLIKE_SKIN, WEAKLY_LIT = 0.086, 1.80, 0.137, 0.046
PLAIN_DEVIATION = float(np.hypot(WHOLE_FACE, WEAKLY_LIT))  # of even skin that was lit as usual, whose confidence is 1
# deviations of Gaussians in texels of a 1024 map: detail varies faster than the first, and its variance about a texel
# is taken over the second
DETAIL_TEXELS, AROUND_TEXELS = 8.0, 12.0
DARKEST, DIMMEST = 1e-3, 0.05  # linear albedo, and brightness in the frames over usual skin's: below is noise


def estimate_confidence(evidence: Evidence, albedo: np.ndarray) -> np.ndarray:
    """Return the confidence [S, S] in [0, 1] of a linear albedo [S, S, 3].

    It is PLAIN_DEVIATION over the deviation of the texel's error in natural log, less where the texel was seen less, 0
    where it was not.
    """
    deviation = np.sqrt(variances(evidence, albedo) @ np.square([WHOLE_FACE, VARIED, UNLIKE_SKIN, WEAKLY_LIT]))
    return (evidence.weight.numpy() * np.minimum(PLAIN_DEVIATION / deviation, 1)).astype(np.float32)


def variances(evidence: Evidence, albedo: np.ndarray) -> np.ndarray:
    """Return [S, S, 4], which the squares of WHOLE_FACE, VARIED, UNLIKE_SKIN and WEAKLY_LIT weigh.

    They are 1, the albedo's own variance about a texel, how little its colour says of the light, and how many times
    darker than usual skin it was filmed.
    """
    log = np.log(np.maximum(albedo.mean(2), DARKEST)).astype(np.float32)
    detail = log - _blur(log, DETAIL_TEXELS / evidence.texel)
    varied = _blur(detail**2, AROUND_TEXELS / evidence.texel)
    weakness = 1 / np.maximum(evidence.filmed.numpy(), DIMMEST)
    return np.stack([np.ones_like(log), varied, 1 - evidence.trust.numpy(), weakness], 2)


def _blur(image: np.ndarray, deviation: float) -> np.ndarray:
    return cv2.GaussianBlur(image, (0, 0), max(deviation, 0.3))
