# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One head has one albedo: what the frames say of it is averaged in the head's UV space, and each frame's shading is
moved to agree with the mean. Robustly, for highlights move from frame to frame and albedo does not.

Only coarsely, as registration is a pixel off at times, and the frames' own shadow edges are to stay where they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from ...face.head import Unfolded
from ...geometry.raster import interpolate, sample, sample_uv, visible_from
from ...geometry.views import View
from .lit_head import LitHead

UV_TEXELS = 256  # side of the map in which the frames' answers are compared
COARSE_CELLS = 3.0  # cells of the network's map below which nothing is moved
MIN_WEIGHT = 0.05  # weight from which a texel is known
HALF_WEIGHT_LOG = 0.12  # natural log units from the others' mean at which what a view says counts half


@dataclass(frozen=True)
class ShadingEstimate:
    """What the network says of one picture. box: left, top and side in pixels of the square it saw; shading [h, h, 3]
    natural log, shadow [h, h] in [0, 1] and log [h, h, 3], the picture's own at that size; face int [h, h] and bary [h,
    h, 3]: the head there (-1: none), if it is known."""

    box: tuple[float, float, float]
    shading: np.ndarray
    shadow: np.ndarray
    log: np.ndarray
    face: np.ndarray | None = None
    bary: np.ndarray | None = None


def even_out(head: LitHead, views: list[View], looks: list[ShadingEstimate]) -> list[ShadingEstimate]:
    """The looks of these views with shadings that agree about the head's albedo."""
    if len(looks) < 2:
        return looks
    surface = head.head.unfold(UV_TEXELS)
    texel = np.flatnonzero(surface.covered)
    per_view = [_opinion(surface, view, look) for view, look in zip(views, looks, strict=True)]
    opinions, weights = (np.stack(arrays) for arrays in zip(*per_view, strict=True))
    level = estimate_exposures(opinions, weights)
    mean = robust_mean(opinions - level[:, None], weights)
    known = np.zeros(UV_TEXELS**2, np.float32)
    known[texel] = np.minimum(weights.sum(0) / MIN_WEIGHT, 1) * (weights.sum(0) > MIN_WEIGHT)
    albedo = np.zeros((UV_TEXELS**2, 3), np.float32)
    albedo[texel] = mean
    albedo, known = albedo.reshape(UV_TEXELS, UV_TEXELS, 3), known.reshape(UV_TEXELS, UV_TEXELS)
    return [
        _agreeing(head, replace(look, shading=look.shading + off), albedo, known)
        for look, off in zip(looks, level, strict=True)
    ]


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


def _opinion(surface: Unfolded, view: View, look: ShadingEstimate) -> tuple[np.ndarray, np.ndarray]:
    """Log-albedo [N, 3] that a look gives the surface's points, and how far it counts [N]."""
    points, normals = surface.points, surface.normals
    towards = view.centre - points
    cosine = (towards * normals).sum(1) / np.linalg.norm(towards, axis=1)
    pixels, _ = view.project(points)
    side = len(look.shading)
    at = (pixels - look.box[:2]) * side / look.box[2]
    # nan is not
    inside = ((at > 1) & (at < side - 1)).all(1) & ((pixels > 1) & (pixels < [view.width - 1, view.height - 1])).all(1)
    seen = np.flatnonzero((cosine > 0.2) & inside)
    seen = seen[visible_from(surface.caster, points[seen], normals[seen], view.centre)]
    log_albedo, weight = np.zeros((len(points), 3), np.float32), np.zeros(len(points), np.float32)
    log_albedo[seen] = sample(look.log - look.shading, at[seen])
    weight[seen] = cosine[seen] ** 2
    return log_albedo, weight


def _agreeing(head: LitHead, look: ShadingEstimate, albedo: np.ndarray, confidence: np.ndarray) -> ShadingEstimate:
    uv = interpolate(head.mesh.uvs, head.mesh.face_uvs, look.face, look.bary).reshape(-1, 2)
    weight = sample_uv(confidence, uv).reshape(look.face.shape) * (look.face >= 0)
    weight = np.where(weight > 0.99, weight, 0).astype(np.float32)
    off = (look.log - look.shading - sample_uv(albedo, uv).reshape(*look.face.shape, 3)) * weight[..., None]
    carried = cv2.GaussianBlur(weight, (0, 0), COARSE_CELLS)
    off = cv2.GaussianBlur(off.astype(np.float32), (0, 0), COARSE_CELLS) / np.maximum(carried, 0.02)[..., None]
    mean = off[weight > 0].mean(0) if (weight > 0).any() else np.zeros(3, np.float32)
    share = np.clip(carried / 0.3, 0, 1)[..., None]
    return replace(look, shading=look.shading + share * off + (1 - share) * mean)
