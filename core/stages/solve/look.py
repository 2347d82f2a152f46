# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Summarise a person's skin in the frames by two colours: the best lit skin, and skin that faces as the face does.

Over a capture's views each point of the head gets one colour, a low quantile of what the views show: highlights move
with the camera, the skin's own colour does not. Lips, brows, beard, shadow and burnt-out pixels do not count.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ...capture.capture import Capture
from ...capture.messages import Reporter
from ...face import template
from ...face.head import Head
from ...geometry import raster
from ...geometry.meshes import vertex_uvs
from ...geometry.views import View, read_views
from ...imaging import images
from ...light.spherical_harmonics import sh_basis
from .witnesses import find_visible

FRONT = np.array([0.0, -1.0, 0.0])  # unit normal of what faces the camera, in the head's axes
VIEW_QUANTILE = 0.3  # over the views: below the median, as every highlight brightens and nothing but shadow darkens
# quantiles of luminance between which skin is best lit; what is above is highlights that stood still
BEST_LIT_QUANTILES = 0.75, 0.95
BURNT_SRGB = 0.98  # sRGB from which a channel has lost its value
MIN_SKIN_POINTS = 60  # points of skin
SMOOTHING_SHARE = 0.003  # of the frame's longer side: what noise and a head that is off by a pixel amount to
LIKE_RATIOS = 0.75, 1.35  # brightness over that of evenly lit skin, beyond which a point is shadow, mark or highlight
LUMINANCE_WEIGHTS = np.array([0.2126, 0.7152, 0.0722])  # of linear sRGB (IEC 61966-2-1)
# per point, on the harmonics' coefficients: 1e-6, 0.01 and 0.1 on those of 1, of x, y, z and of xy, yz, z^2 - 1/3, xz,
# x^2 - y^2
SH_RIDGE = np.array([1e-6, *[0.03] * 3, 1.5, 1.5, 1.125, 1.5, 0.375]) / (4 * np.pi)
BEARD_TOP_V = 0.42  # v of the texture below which a beard may grow, whose colour is not the skin's


@dataclass(frozen=True)
class Look:
    """Linear colours [3] of skin as the camera shows them: in the best light, and facing -Y, the way the face looks."""

    best: np.ndarray
    front: np.ndarray


def summarise_look(colours: np.ndarray, normals: np.ndarray, weight: np.ndarray) -> Look:
    """Return the look of skin points: linear colours [N, 3], unit normals [N, 3] in the head's axes, weights [N]."""
    return Look(mean_best_lit(colours, weight), _facing_front(colours, normals, weight))


def mean_best_lit(colours: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the mean [3] of the best lit of linear colours [N, 3] under weights [N], highlights left out."""
    order = np.argsort(colours @ LUMINANCE_WEIGHTS)
    rank = np.cumsum(weight[order]) / weight.sum()
    best = order[(rank >= BEST_LIT_QUANTILES[0]) & (rank <= BEST_LIT_QUANTILES[1])]
    return np.average(colours[best], axis=0, weights=weight[best] + 1e-9)


def read_look(capture: Capture, head: Head, shadow: np.ndarray, report: Reporter) -> Look | None:
    """Return the look of the selected frames, as they were filmed; None without frames, cameras or enough skin.

    shadow [S, S] is the soft mask in the head's UVs.
    """
    if not capture.frames_json.is_file() or not capture.cameras.is_dir():
        return None
    views = [view for view in read_views(capture, selected_only=True) if view.path.is_file()]
    if not views:
        return None
    mesh, normals = head.mesh, head.normals
    weight = raster.sample_uv(weigh_skin(512, shadow), vertex_uvs(mesh))
    points = np.flatnonzero(weight > 0.05)
    colours = np.full((len(views), len(points), 3), np.nan)
    for i, view in enumerate(views):
        report.progress(0, len(views), f"looking at the skin in frame {i + 1} of {len(views)}")
        colours[i] = _read_colours(view, head.caster, mesh.vertices[points], normals[points])
    often = np.isfinite(colours[..., 0]).sum(0) >= min(2, len(views))
    if often.sum() < MIN_SKIN_POINTS:
        return None
    points = points[often]
    return summarise_look(_low_quantile(colours[:, often]), normals[points], weight[points])


def weigh_skin(size: int, shadow: np.ndarray) -> np.ndarray:
    """Return weights [size, size] of plain facial skin out of the `shadow` [S, S] and out of a beard's reach."""
    skin = template.mask("skin", size) * template.mask("face", size)
    for name in ("lips", "brows", "eyes", "nostrils"):
        skin = skin * (1 - template.mask(name, size))
    skin[round(size * (1 - BEARD_TOP_V)) :] = 0
    shadow = cv2.dilate(images.resize(shadow.astype(np.float32), size, size), np.ones((3, 3)))
    return skin * np.clip(1 - 3 * shadow, 0, 1)  # half a shadow darkens skin, too


def _facing_front(colours: np.ndarray, normals: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the colour [3] of skin whose normal is FRONT, by second-order spherical harmonics fitted to the skin."""
    weight = weight * np.clip(normals @ FRONT, 0, None)
    basis, front = sh_basis(normals), sh_basis(FRONT)
    inliers = np.ones(len(colours))
    for _ in range(5):
        weighted = basis * (weight * inliers)[:, None]
        ridge = np.diag(SH_RIDGE) * (weight * inliers).sum()
        light = np.linalg.solve(basis.T @ weighted + ridge, weighted.T @ colours)
        ratio = (colours @ LUMINANCE_WEIGHTS) / np.maximum(basis @ light @ LUMINANCE_WEIGHTS, 1e-6)
        inliers = ((ratio > LIKE_RATIOS[0]) & (ratio < LIKE_RATIOS[1])).astype(float)
        if (weight * inliers).sum() < 0.1 * weight.sum():
            break
    return np.maximum(front @ light, 1e-4)


def _read_colours(view: View, caster: raster.RayCaster, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return linear colours [N, 3] of surface points in a view's frame, nan if hidden or burnt out."""
    colours, frame = np.full((len(points), 3), np.nan), view.read()
    facing = np.flatnonzero(find_visible(view, caster, points, normals))
    if len(facing):
        pixels, _ = view.project(points[facing])
        smooth = cv2.GaussianBlur(images.srgb_to_linear(frame), (0, 0), SMOOTHING_SHARE * max(frame.shape[:2]))
        whole = raster.sample(frame.max(-1), pixels) < BURNT_SRGB
        colours[facing[whole]] = raster.sample(smooth, pixels[whole])
    return colours


def _low_quantile(colours: np.ndarray) -> np.ndarray:
    """Return the VIEW_QUANTILE [N, 3] over the views of [V, N, 3], of which each point has a value that is not nan."""
    count = np.isfinite(colours[..., 0]).sum(0)
    at = np.floor(VIEW_QUANTILE * (count - 1)).astype(int)
    return np.take_along_axis(np.sort(colours, 0), at[None, :, None], 0)[0]  # sort puts nan last
