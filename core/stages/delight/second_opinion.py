# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In a capture there are two answers: the network's for each frame, and that of the light fitted to all frames. Their
errors differ, so a mean is better than either.

The fit holds over the whole head and knows the colours of sun and sky; the network knows what no fit explains: a lamp
that was not found, a lifted hand. How far the fit is to be believed shows in how far the two lie apart over the bare
skin of the whole capture. Never place by place: where they differ most the network has taken lips or moles for shade.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from .evening import ShadingEstimate


@dataclass(frozen=True)
class Weighing:
    """How far an answer counts beside the frames' own: `share` where the two agree, half of it where the luminance of
    their shadings is `doubt` apart over a capture (natural log units, root mean square)."""

    share: float
    doubt: float


FITTED = Weighing(share=0.6, doubt=0.15)
"""Of the fitted light: the best over twelve people in sixteen captures (research/benchmarks/delight_answers.py)."""


def weigh_in(
    looks: list[ShadingEstimate], answers: list[np.ndarray], skins: list[np.ndarray], weighing: Weighing = FITTED
) -> list[ShadingEstimate]:
    """The looks moved towards another answer, brought to their level over bare skin; as they are where no skin tells
    the level.

    Parameters
    ----------
    looks : one for each frame
    answers : [h, h, 3] for each, log-shading
    skins : [h, h] for each, in [0, 1], bare skin above 0.5
    weighing : how far the other answer counts
    """
    apart = np.concatenate(
        [(answer - look.shading)[skin > 0.5] for look, answer, skin in zip(looks, answers, skins, strict=True)]
    )
    if not len(apart):
        return looks
    level = np.median(apart, 0)
    weight = weighing.share / (1 + np.mean((apart - level).mean(-1) ** 2) / weighing.doubt**2)
    return [
        replace(
            look,
            shading=np.where(
                (look.face >= 0)[..., None], look.shading + weight * (answer - level - look.shading), look.shading
            ).astype(np.float32),
        )
        for look, answer in zip(looks, answers, strict=True)
    ]


def continue_beyond(
    shading: np.ndarray,
    shadow: np.ndarray,
    confidence: np.ndarray,
    box: tuple[slice, slice],
    light: np.ndarray,
    share: np.ndarray,
    on_head: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """A frame's shading and shadow, carried on by the fitted light where confidence falls to 0: scalp and neck lie
    beyond what the network sees.

    Parameters
    ----------
    shading : [H, W, 3], log-shading of the frame
    shadow : [H, W] in [0, 1]
    confidence : [H, W] in [0, 1], how far the two hold
    box : rows and columns [h, w] of the frame that hold the head
    light : [h, w, 3], linear, the fitted light there; it is taken over at the level of the rest
    share : [h, w] in [0, 1], of its sun
    on_head : bool [h, w]

    Returns
    -------
    Shading [H, W, 3] and shadow [H, W].
    """
    log = np.log(np.maximum(light, 1e-4))
    sure = on_head & (confidence[box] > 0.99)
    if not sure.any():
        return shading, shadow
    level = np.median((log - shading[box])[sure], 0)
    shading, shadow, weight = shading.copy(), shadow.copy(), confidence[box]
    shading[box] = weight[..., None] * shading[box] + (1 - weight[..., None]) * (log - level)
    shadow[box] = weight * shadow[box] + (1 - weight) * (1 - share) * on_head
    return shading, shadow


def average_cells(light: np.ndarray, side: int) -> np.ndarray:
    """The log [side, side, 3] of the light in a square picture, linear [S, S, 3], averaged as the eye would."""
    return np.log(
        np.maximum(cv2.resize(np.asarray(light, np.float32), (side, side), interpolation=cv2.INTER_AREA), 1e-4)
    )
