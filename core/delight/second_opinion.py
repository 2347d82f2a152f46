# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In a capture there are two answers: the network's, and that of the light fitted to all frames. Their errors differ,
so a mean of both is better than either.

The fit holds over the whole head and knows the colours of sun and sky; the network knows what no fit explains. Where
they are far apart the fit is wrong more often: a lamp it did not find, a lifted hand, hair.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from .evening import ShadingEstimate

FITTED = 0.8  # weight of the fitted light's answer where the two agree ...
DOUBT = 1.0  # ... and natural log units of luminance between them at which it is half of that


def of_both(looks: list[ShadingEstimate], fitted: list[np.ndarray], skins: list[np.ndarray]) -> list[ShadingEstimate]:
    """The looks moved towards the fitted log-shading [h, h, 3] of each, brought to their level over bare skin (skins
    [h, h], above 0.5 there)."""
    apart = [(log - look.shading)[skin > 0.5] for look, log, skin in zip(looks, fitted, skins, strict=True)]
    if not sum(map(len, apart)):
        return looks
    level = np.median(np.concatenate(apart), 0)
    return [_towards(look, log - level) for look, log in zip(looks, fitted, strict=True)]


def beyond(shading: np.ndarray, shadow: np.ndarray, known: np.ndarray, box: tuple[slice, slice], light: np.ndarray,
           share: np.ndarray, here: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A frame's log-shading [H, W, 3] and shadow [H, W], where known [H, W] in [0, 1] falls to 0 taken over by the
    fitted light [h, w, 3] and its share [h, w] in the part `box` of the frame, at the level of the rest; here bool [h,
    w]: the head. Scalp and neck lie beyond what the network sees."""
    log = np.log(np.maximum(light, 1e-4))
    sure = here & (known[box] > 0.99)
    if not sure.any():
        return shading, shadow
    level = np.median((log - shading[box])[sure], 0)
    shading, shadow, weight = shading.copy(), shadow.copy(), known[box]
    shading[box] = weight[..., None] * shading[box] + (1 - weight[..., None]) * (log - level)
    shadow[box] = weight * shadow[box] + (1 - weight) * (1 - share) * here
    return shading, shadow


def coarse(light: np.ndarray, side: int) -> np.ndarray:
    """The log [side, side, 3] of the light in a square picture, linear [S, S, 3], averaged as the eye would."""
    return np.log(np.maximum(cv2.resize(np.asarray(light, np.float32), (side, side), interpolation=cv2.INTER_AREA),
                             1e-4))


def _towards(look: ShadingEstimate, log: np.ndarray) -> ShadingEstimate:
    apart = log - look.shading
    weight = FITTED / (1 + (apart.mean(-1, keepdims=True) / DOUBT) ** 2) * (look.face >= 0)[..., None]
    return replace(look, shading=(look.shading + weight * apart).astype(np.float32))
