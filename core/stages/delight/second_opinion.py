# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Second opinion: the mean of the network's answer for a frame and that of the light fitted to all frames of a capture.

Their errors differ, so it is better than either. The fit holds over the whole head and has the colours of sun and sky;
the network sees what no fit explains: a lamp that was not found, a lifted hand. The fit is trusted less the farther the
two lie apart over the bare skin of the whole capture. Never place by place: where they differ most the network has
taken lips or moles for shade.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .evening import ShadingEstimate


@dataclass(frozen=True)
class Weighing:
    """Weight of an answer beside the frames' own.

    It is `share` if the two agree, half of it if the luminance of their shadings is `doubt` apart over a capture
    (natural log units, root mean square).
    """

    share: float
    doubt: float


FITTED = Weighing(share=0.6, doubt=0.15)
"""For the fitted light: the best over twelve people in sixteen captures
(research/benchmarks/delighting/delight_answers.py)."""


def weigh_in(
    looks: list[ShadingEstimate], answers: list[np.ndarray], skins: list[np.ndarray], weighing: Weighing = FITTED
) -> list[ShadingEstimate]:
    """Move the looks, one for each frame, towards other answers [h, h, 3] brought to their level over bare skin.

    skins: [h, h] each, above 0.5 on bare skin; without any the looks stay.
    """
    apart = np.concatenate(
        [(answer - look.shading)[skin > 0.5] for look, answer, skin in zip(looks, answers, skins, strict=True)]
    )
    if not len(apart):
        return looks
    level = np.median(apart, 0)
    weight = weighing.share / (1 + np.mean((apart - level).mean(-1) ** 2) / weighing.doubt**2)
    moved = []
    for look, answer in zip(looks, answers, strict=True):
        shading = look.shading + weight * (answer - level - look.shading)
        shading = np.where((look.face >= 0)[..., None], shading, look.shading)
        moved.append(replace(look, shading=shading.astype(np.float32)))
    return moved


def continue_beyond(
    shading: np.ndarray,
    shadow: np.ndarray,
    confidence: np.ndarray,
    box: tuple[slice, slice],
    light: np.ndarray,
    share: np.ndarray,
    on_head: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Continue a frame's log-shading [H, W, 3] and shadow [H, W] by the fitted light where confidence falls to 0.

    Scalp and neck lie beyond what the network sees. box: rows and columns [h, w] of the frame that hold the head;
    there, light: linear [h, w, 3], brought to the level of the rest; share [h, w] in [0, 1]: of its sun; on_head: bool
    [h, w].
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
