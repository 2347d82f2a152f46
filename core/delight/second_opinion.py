# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In a capture there are three answers: the network's for each frame, that of the light fitted to all frames, and the
whole head's. Their errors differ, so a mean is better than any.

The fit holds over the whole head and knows the colours of sun and sky; the network knows what no fit explains. Where
they are far apart the fit is wrong more often: a lamp it did not find, a lifted hand, hair. The whole head's answer
follows little of the pigment, and takes a single small shadow for it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from .evening import ShadingEstimate

FITTED_WEIGHT = 0.8  # weight of the fitted light's answer where the two agree ...
DOUBT_LOG = 1.0  # ... and natural log units of luminance between them at which it is half of that
# on five captures of five synthetic people, by the PSNR and FLIP of their delit frames; nobody was left out
WHOLE_HEAD_WEIGHT = 0.5  # weight of the whole head's answer ...
MISSED_SHARE = 0.25  # ... which is nothing where so much of the sun is lost of which it does not know ...
MISSED_CELLS = 1.0  # ... on average over a Gaussian of that deviation: borders are not where a shadow is missed


@dataclass(frozen=True)
class HeadInLook:
    """The whole head's answer where a look shows the head, 0 elsewhere: log [h, h, 3], its log-shading, and shadow [h,
    h] in [0, 1]."""

    log: np.ndarray
    shadow: np.ndarray


def combine_answers(looks: list[ShadingEstimate], fitted: list[np.ndarray],
                    skins: list[np.ndarray]) -> list[ShadingEstimate]:
    """The looks moved towards the fitted log-shading [h, h, 3] of each, brought to their level over bare skin (skins
    [h, h], above 0.5 there)."""
    apart = [(log - look.shading)[skin > 0.5] for look, log, skin in zip(looks, fitted, skins, strict=True)]
    if not sum(map(len, apart)):
        return looks
    level = np.median(np.concatenate(apart), 0)
    return [_towards(look, log - level) for look, log in zip(looks, fitted, strict=True)]


def move_to_whole_head(looks: list[ShadingEstimate], heads: list[HeadInLook],
                       skins: list[np.ndarray]) -> list[ShadingEstimate]:
    """The looks moved by WHOLE_HEAD_WEIGHT towards the whole head's log-shading in each, brought to their level over
    bare skin (skins [h, h], above 0.5 there). A shadow that a look shows and the whole head does not know is one that
    it took for pigment: there the look keeps its own."""
    apart = [(head.log - look.shading)[skin > 0.5] for look, head, skin in zip(looks, heads, skins, strict=True)]
    if not sum(map(len, apart)):
        return looks
    level = np.median(np.concatenate(apart), 0)
    return [_halfway(look, head, level) for look, head in zip(looks, heads, strict=True)]


def _halfway(look: ShadingEstimate, head: HeadInLook, level: np.ndarray) -> ShadingEstimate:
    missed = np.clip(look.shadow - head.shadow, 0, 1).astype(np.float32)
    known = 1 - np.clip(cv2.GaussianBlur(missed, (0, 0), MISSED_CELLS) / MISSED_SHARE, 0, 1)
    weight = (WHOLE_HEAD_WEIGHT * known * (look.face >= 0))[..., None]
    return replace(look, shading=(look.shading + weight * (head.log - level - look.shading)).astype(np.float32))


def continue_beyond(shading: np.ndarray, shadow: np.ndarray, known: np.ndarray, box: tuple[slice, slice],
                    light: np.ndarray, share: np.ndarray, here: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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


def average_cells(light: np.ndarray, side: int) -> np.ndarray:
    """The log [side, side, 3] of the light in a square picture, linear [S, S, 3], averaged as the eye would."""
    return np.log(np.maximum(cv2.resize(np.asarray(light, np.float32), (side, side), interpolation=cv2.INTER_AREA),
                             1e-4))


def _towards(look: ShadingEstimate, log: np.ndarray) -> ShadingEstimate:
    apart = log - look.shading
    weight = FITTED_WEIGHT / (1 + (apart.mean(-1, keepdims=True) / DOUBT_LOG) ** 2) * (look.face >= 0)[..., None]
    return replace(look, shading=(look.shading + weight * apart).astype(np.float32))
