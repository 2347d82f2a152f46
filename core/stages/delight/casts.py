# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour casts left in the albedo, removed: skin does not change its hue where a shadow falls.

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
MIN_SKIN_CELLS = 200  # with fewer nothing is changed
HUE_DEVIATION_LOG = 0.05
"""Of a face's skin about its mean, along each of a hue's two axes, in natural log: painted skins' traits have 0.045
(TYPICAL_SCALES and AXIS_DEVIATIONS in core/solver/extensions/split.py)."""
CODE_VALUE = 1 / 255  # of a frame


def remove_casts(looks: list[ShadingEstimate], skins: list[np.ndarray]) -> list[ShadingEstimate]:
    """Return the looks with one hue of skin in light and shade; skins: [h, h] each, above 0.5 on bare skin."""
    if not _enough(skins):
        return looks
    middle = _on_skin([look.shading.mean(-1) for look in looks], skins).mean()
    features = [_features(look, middle) for look in looks]
    x = _on_skin(features, skins)  # [N, 4]
    y = _on_skin([_hue(look.log - look.shading) for look in looks], skins)  # [N, 3]
    trust = np.ones(len(x))
    for _ in range(4):
        centre, level = np.average(x, axis=0, weights=trust), np.average(y, axis=0, weights=trust)
        weighted = (x - centre) * trust[:, None]
        ridge = RIDGE * len(x) * np.eye(x.shape[1])
        slopes = np.linalg.solve(weighted.T @ (x - centre) + ridge, weighted.T @ (y - level))  # [4, 3]
        trust = 1 / (1 + ((y - level - (x - centre) @ slopes) ** 2).sum(1) / USUAL_HUE_LOG**2)
    return [
        replace(look, shading=(look.shading + (f - centre) @ slopes).astype(np.float32))
        for look, f in zip(looks, features, strict=True)
    ]


def settle_dim_hues(looks: list[ShadingEstimate], skins: list[np.ndarray]) -> list[ShadingEstimate]:
    """Return the looks with the hue of the other skin where skin is too dark to show its own.

    It is the most probable one if skin deviates from its mean by HUE_DEVIATION_LOG and a picture from the truth by one
    code value (Wiener 1949). skins: as for `remove_casts`.
    """
    if not _enough(skins):
        return looks
    hues, doubts = [_hue(look.log - look.shading) for look in looks], [_doubt(look.log) for look in looks]
    weights = 1 / (HUE_DEVIATION_LOG**2 + _on_skin(doubts, skins))
    level = np.average(_on_skin(hues, skins), axis=0, weights=weights)
    moved = [skin * doubt / (HUE_DEVIATION_LOG**2 + doubt) for skin, doubt in zip(skins, doubts, strict=True)]
    return [
        replace(look, shading=(look.shading + share[..., None] * (hue - level)).astype(np.float32))
        for look, share, hue in zip(looks, moved, hues, strict=True)
    ]


def _enough(skins: list[np.ndarray]) -> bool:
    return sum(int((skin > 0.5).sum()) for skin in skins) >= MIN_SKIN_CELLS


def _on_skin(fields: list[np.ndarray], skins: list[np.ndarray]) -> np.ndarray:
    """Gather the values [N(, C)] of fields [h, h(, C)] on bare skin."""
    return np.concatenate([field[skin > 0.5] for field, skin in zip(fields, skins, strict=True)])


def _doubt(log: np.ndarray) -> np.ndarray:
    """Return the variance [...] along each of a hue's two axes if all channels of a log colour are a code value off."""
    linear = np.minimum(np.exp(log), 1)
    step = np.log(images.srgb_to_linear(images.linear_to_srgb(linear) + CODE_VALUE) / linear)
    return (step**2).mean(-1)


def _features(look: ShadingEstimate, middle: float) -> np.ndarray:
    """Return what light may depend on, [h, h, 4]: the shading's brightness, its square, the shadow, and both."""
    bright = np.clip(look.shading.mean(-1) - middle, -2.5, 2.5)
    return np.stack([bright, bright**2, look.shadow, bright * look.shadow], -1)


def _hue(log: np.ndarray) -> np.ndarray:
    """Return a log colour [..., 3] without its luminance."""
    return log - log.mean(-1, keepdims=True)
