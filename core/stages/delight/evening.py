# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Evening out: one head has one albedo, so each frame's shading is moved to agree with the mean over all frames.

The mean is taken in the head's UV space, robustly, for highlights move from frame to frame and albedo does not. Only
coarse differences are moved, as registration is a pixel off at times, and the frames' own shadow edges are to stay.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch

from ...face.head import Unfolded
from ...geometry.raster import interpolate, sample, sample_uv
from ...geometry.views import View
from ...geometry.visibility import points_in_view
from ...imaging.normalized_convolution import weighted_blur
from .lit_head import LitHead

UV_TEXELS = 256  # side of the map in which the frames' answers are compared
COARSE_CELLS = 3.0  # cells of the network's map below which nothing is moved
MIN_WEIGHT = 0.05  # of a texel that enters the mean
HALF_WEIGHT_LOG = 0.12  # natural log units from the others' mean at which a view counts half


@dataclass(frozen=True)
class ShadingEstimate:
    """Shading of one picture by the network.

    box: left, top and side in pixels of the square it covers; shading [h, h, 3] natural log, shadow [h, h] in [0, 1]
    and log [h, h, 3], the picture's own at that size; face int [h, h] and bary [h, h, 3]: the head there (-1: none), if
    it is known. grid [1, 4, bins, h, h]: what the network said, and answer [h, h, 3] the shading of it, which
    `shading` moves away from as more is known.
    """

    box: tuple[float, float, float]
    shading: np.ndarray
    shadow: np.ndarray
    log: np.ndarray
    face: np.ndarray | None = None
    bary: np.ndarray | None = None
    grid: torch.Tensor | None = None
    answer: np.ndarray | None = None


def even_out(head: LitHead, views: list[View], looks: list[ShadingEstimate]) -> list[ShadingEstimate]:
    """Return the looks of these views with shadings that agree about the head's albedo."""
    if len(looks) < 2:
        return looks
    surface = head.head.unfold(UV_TEXELS)
    per_view = [_opinion(surface, view, look) for view, look in zip(views, looks, strict=True)]
    opinions, weights = (np.stack(arrays) for arrays in zip(*per_view, strict=True))
    level = estimate_exposures(opinions, weights)
    albedo = surface.spread(robust_mean(opinions - level[:, None], weights))
    total = weights.sum(0)
    confidence = surface.spread(np.minimum(total / MIN_WEIGHT, 1) * (total > MIN_WEIGHT))
    return [
        _agreeing(head, replace(look, shading=look.shading + off), albedo, confidence)
        for look, off in zip(looks, level, strict=True)
    ]


def estimate_exposures(colours: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return by how much each view's log colours [V, N, 3] exceed the others', [V, 3] of mean 0; weights [V, N].

    Without it, what one view alone sees would keep that view's exposure.
    """
    level = np.zeros((len(colours), 3), np.float32)
    shared = (weights > 0) & ((weights > 0).sum(0) > 1)
    for _ in range(20):
        mean = robust_mean(colours - level[:, None], weights)
        for view in np.flatnonzero(shared.any(1)):
            level[view] += np.median((colours[view] - level[view] - mean)[shared[view]], 0)
        level -= level.mean(0)
    return level


def robust_mean(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the mean over the views of [V, N, 3] with weights [V, N]; outliers count less (a Cauchy weight)."""
    mean = (values * weights[..., None]).sum(0) / np.maximum(weights.sum(0), 1e-6)[:, None]
    for _ in range(4):
        trust = weights / (1 + ((values - mean) ** 2).mean(-1) / HALF_WEIGHT_LOG**2)
        mean = (values * trust[..., None]).sum(0) / np.maximum(trust.sum(0), 1e-6)[:, None]
    return mean


def _opinion(surface: Unfolded, view: View, look: ShadingEstimate) -> tuple[np.ndarray, np.ndarray]:
    """Return the log-albedo [N, 3] that a look gives the surface's points, and its weight [N]."""
    visible, cosine, pixels = points_in_view(surface.caster, view, surface.points, surface.normals, 0.2)
    side = len(look.shading)
    at = (pixels - look.box[:2]) * side / look.box[2]
    visible = visible[((at > 1) & (at < side - 1)).all(1)[visible]]
    log_albedo, weight = np.zeros((len(at), 3), np.float32), np.zeros(len(at), np.float32)
    log_albedo[visible] = sample(look.log - look.shading, at[visible])
    weight[visible] = cosine[visible] ** 2
    return log_albedo, weight


def _agreeing(head: LitHead, look: ShadingEstimate, albedo: np.ndarray, confidence: np.ndarray) -> ShadingEstimate:
    """Move a look's shading so that its coarse albedo is that of the map [S, S, 3], where confidence [S, S] is 1."""
    uv = interpolate(head.mesh.uvs, head.mesh.face_uvs, look.face, look.bary).reshape(-1, 2)
    weight = sample_uv(confidence, uv).reshape(look.face.shape) * (look.face >= 0)
    weight = np.where(weight > 0.99, weight, 0).astype(np.float32)
    off = look.log - look.shading - sample_uv(albedo, uv).reshape(*look.face.shape, 3)
    coarse = weighted_blur(off, weight, COARSE_CELLS, 0.02)
    mean = coarse[weight > 0].mean(0) if (weight > 0).any() else np.zeros(3, np.float32)
    share = np.clip(cv2.GaussianBlur(weight, (0, 0), COARSE_CELLS) / 0.3, 0, 1)[..., None]
    return replace(look, shading=look.shading + share * coarse + (1 - share) * mean)
