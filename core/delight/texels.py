# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head in its own UV space as all views saw it, with the light in it: what is known of each texel before a network
says what of it is light.

One head has one albedo, whatever frame shows it: so the views' colours are brought to one exposure and averaged,
robustly, for highlights move and albedo does not. Beside them stands what geometry knows: normals, how much of the sky
each texel sees, and the light that was fitted to the skin.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from ..geometry import raster
from ..geometry.views import View, lengths
from ..imaging import images
from ..light.skylight import ambient_occlusion
from .lit_head import LitHead

SIDE_TEXELS = 512
"""Of the maps: a texel is some 0.8 mm of the face."""
MIN_LINEAR = 0.004
"""Linear values below this are noise to a logarithm."""
MIN_FACING_COSINE = 0.2
"""Cosine of the steepest angle under which a view counts."""
HALF_WEIGHT_LOG = 0.12
"""Natural log units from the others' mean at which what a view says counts half."""
BORDER_TEXELS = 24.0
"""Distance from the border of the sun's light at which it does not matter any more."""
EXPOSURE_STRIDE = 16
"""Of so many texels one tells how the views' exposures differ."""


@dataclass(frozen=True)
class Texels:
    """float32 maps [S, S, ...] in the built-in head's UVs. log [3]: natural log of the linear colour in the views'
    mean; spread: how far the views' luminance lies from it, in log units; seen in [0, 1]; normal [3]: unit, in the
    head's axes; open in [0, 1]: the share of an even sky that reaches the surface; ambient [3]: the linear colour of
    the head's skin under the fitted sky; direct [3]: what the fitted sun adds where nothing blocks it; free in [0, 1]:
    where the head itself lets the sun through. The built-in head covers every texel."""

    log: np.ndarray
    spread: np.ndarray
    seen: np.ndarray
    normal: np.ndarray
    open: np.ndarray
    ambient: np.ndarray
    direct: np.ndarray
    free: np.ndarray


def gather_texels(head: LitHead, views: list[View], step: Callable[[int, int], None] = lambda done, of: None) -> Texels:
    """What these views say of the head. The head has the built-in UVs; step(done, of) is told of each view."""
    surface = head.head.unfold(SIDE_TEXELS)
    colours, weights = (np.zeros((len(views), len(surface.points), n), np.float32) for n in (3, 1))
    for i, view in enumerate(views):
        step(i, len(views))
        colours[i], weights[i, :, 0] = _colours_seen(surface.points, surface.normals, surface.caster, view)
    some = np.s_[:, ::EXPOSURE_STRIDE]
    colours -= estimate_exposures(colours[some], weights[..., 0][some])[:, None]
    mean = robust_mean(colours, weights[..., 0])
    total = np.maximum(weights.sum(0)[:, 0], 1e-6)
    spread = np.sqrt((weights[..., 0] * (colours - mean).mean(-1) ** 2).sum(0) / total)
    ambient, direct, free, normal = head.at(surface.face, surface.bary)
    transfer = raster.interpolate(head.transfer, head.mesh.faces, surface.face, surface.bary)
    return Texels(surface.spread(mean), surface.spread(spread), surface.spread(weights[..., 0].max(0)),
                  normal.astype(np.float32),
                  ambient_occlusion(transfer).astype(np.float32), ambient.astype(np.float32), direct.astype(np.float32),
                  free.astype(np.float32))


def _colours_seen(points: np.ndarray, normals: np.ndarray, caster: raster.RayCaster,
                  view: View) -> tuple[np.ndarray, np.ndarray]:
    """Log linear colours [N, 3] of a surface's points in a view, and how far they count [N]: by the cosine of the
    angle, not at all where burnt out."""
    towards = view.centre - points
    cosine = (towards * normals).sum(1) / lengths(towards)
    pixels, _ = view.project(points)
    inside = ((pixels > 1) & (pixels < [view.width - 1, view.height - 1])).all(1)  # nan is not
    seen = np.flatnonzero((cosine > MIN_FACING_COSINE) & inside)
    seen = seen[raster.visible_from(caster, points[seen], normals[seen], view.centre)]
    srgb = raster.sample(images.read_srgb(view.path), pixels[seen])
    log, weight = np.zeros((len(points), 3), np.float32), np.zeros(len(points), np.float32)
    log[seen] = np.log(np.maximum(images.srgb_to_linear(srgb), MIN_LINEAR))
    facing = (cosine[seen] - MIN_FACING_COSINE) / (1 - MIN_FACING_COSINE)
    weight[seen] = facing * np.clip((1 - srgb.max(1)) / 0.02, 0.01, 1)
    return log, weight


def estimate_exposures(colours: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """How much higher than the others' each view's log colours [V, N, 3] are as a whole, [V, 3] of mean 0: without it,
    what one view alone sees would keep that view's exposure. weights [V, N]."""
    level = np.zeros((len(colours), 3), np.float32)
    shared = (weights > 0) & ((weights > 0).sum(0) > 1)
    for _ in range(20):
        mean = robust_mean(colours - level[:, None], weights)
        for view in np.flatnonzero(shared.any(1)):
            level[view] += np.median((colours[view] - level[view] - mean)[shared[view]], 0)
        level -= level.mean(0)
    return level


def robust_mean(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Over the first axis of [V, N, 3] with weights [V, N]; views far from the others count less (a Cauchy weight)."""
    mean = (values * weights[..., None]).sum(0) / np.maximum(weights.sum(0), 1e-6)[:, None]
    for _ in range(4):
        trust = weights / (1 + ((values - mean) ** 2).mean(-1) / HALF_WEIGHT_LOG**2)
        mean = (values * trust[..., None]).sum(0) / np.maximum(trust.sum(0), 1e-6)[:, None]
    return mean


def measure_border_distance(lit: np.ndarray) -> np.ndarray:
    """Signed distance [S, S] to the border of where the fitted sun falls (bool [S, S]), in [-1, 1]: positive within, 1
    from BORDER_TEXELS on, 0 where there is no sun."""
    if not lit.any() or lit.all():
        return np.zeros(lit.shape, np.float32)
    within, beyond = (cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5) for mask in (lit, ~lit))
    return np.tanh(np.where(lit, within, -beyond) * SIDE_TEXELS / len(lit) / BORDER_TEXELS).astype(np.float32)
