# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Skin does not change its hue where a shadow falls: what is left of the light's colour in the albedo is found by that,
and taken out.

Sun and sky differ in colour, and a network learns the difference of usual ones. So the hue of the albedo is regressed
on the brightness of the shading and on the shadow over all skin of the capture; what the regression explains is light
and moves to the shading. Luminance is left alone: beards grow in shade.

Where it is nearly dark a picture does not tell a hue: one code value more or less changes it by more than the skin of a
face varies. There the hue of the rest counts.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...imaging import images
from .evening import ShadingEstimate

RIDGE = 0.01  # a feature's mean square at which half of its slope is taken, against pictures whose light hardly varies
USUAL_HUE_LOG = 0.08  # natural log units of hue from which skin is something else: lips, make-up, a burnt highlight
MIN_SKIN_CELLS = 200  # cells of skin below which nothing is said
HUE_DEVIATION_LOG = 0.05
"""Of a face's skin about its mean, along each of a hue's two axes, in natural log: painted skins' traits have 0.045
(TYPICAL_SCALES and AXIS_DEVIATIONS in core/solver/extensions/split.py)."""
CODE_VALUE = 1 / 255  # of a frame


def remove_casts(looks: list[ShadingEstimate], skins: list[np.ndarray]) -> list[ShadingEstimate]:
    """The looks with one hue of skin in light and shade. skins: [h, h] each, above 0.5 where a look shows bare skin."""
    where = [skin > 0.5 for skin in skins]
    if sum(int(w.sum()) for w in where) < MIN_SKIN_CELLS:
        return looks
    middle = np.mean(np.concatenate([look.shading.mean(-1)[w] for look, w in zip(looks, where, strict=True)]))
    features = [_features(look, middle) for look in looks]
    x = np.concatenate([f[w] for f, w in zip(features, where, strict=True)])  # [N, 4]
    y = np.concatenate([_hue(look.log - look.shading)[w] for look, w in zip(looks, where, strict=True)])  # [N, 3]
    trust = np.ones(len(x))
    for _ in range(4):
        centre, level = np.average(x, axis=0, weights=trust), np.average(y, axis=0, weights=trust)
        weighted = (x - centre) * trust[:, None]
        # [4, 3]
        slopes = np.linalg.solve(
            weighted.T @ (x - centre) + RIDGE * len(x) * np.eye(x.shape[1]), weighted.T @ (y - level)
        )
        trust = 1 / (1 + ((y - level - (x - centre) @ slopes) ** 2).sum(1) / USUAL_HUE_LOG**2)
    return [
        replace(look, shading=(look.shading + (f - centre) @ slopes).astype(np.float32))
        for look, f in zip(looks, features, strict=True)
    ]


def settle_dim_hues(looks: list[ShadingEstimate], skins: list[np.ndarray]) -> list[ShadingEstimate]:
    """The looks with skin that is too dark to tell its hue of the hue of the rest: the most probable one, where skin
    deviates from its mean by HUE_DEVIATION_LOG and what a picture says from the truth by one code value (Wiener 1949).
    skins: as for `remove_casts`."""
    where = [skin > 0.5 for skin in skins]
    if sum(int(w.sum()) for w in where) < MIN_SKIN_CELLS:
        return looks
    hues, doubts = [_hue(look.log - look.shading) for look in looks], [_doubt(look.log) for look in looks]
    level = np.average(
        np.concatenate([hue[w] for hue, w in zip(hues, where, strict=True)]),
        axis=0,
        weights=np.concatenate([1 / (HUE_DEVIATION_LOG**2 + doubt[w]) for doubt, w in zip(doubts, where, strict=True)]),
    )
    moved = [skin * doubt / (HUE_DEVIATION_LOG**2 + doubt) for skin, doubt in zip(skins, doubts, strict=True)]
    return [
        replace(look, shading=(look.shading + share[..., None] * (hue - level)).astype(np.float32))
        for look, share, hue in zip(looks, moved, hues, strict=True)
    ]


def _doubt(log: np.ndarray) -> np.ndarray:
    """Variance [...] along each of a hue's two axes where every channel of a log colour [..., 3] is one code value
    off."""
    linear = np.minimum(np.exp(log), 1)
    step = np.log(images.srgb_to_linear(images.linear_to_srgb(linear) + CODE_VALUE) / linear)
    return (step**2).mean(-1)


def _features(look: ShadingEstimate, middle: float) -> np.ndarray:
    """What light may depend on [h, h, 4]: the shading's brightness, its square, the shadow, and both."""
    bright = np.clip(look.shading.mean(-1) - middle, -2.5, 2.5)
    return np.stack([bright, bright**2, look.shadow, bright * look.shadow], -1)


def _hue(log: np.ndarray) -> np.ndarray:
    """A log colour [..., 3] without its luminance."""
    return log - log.mean(-1, keepdims=True)
