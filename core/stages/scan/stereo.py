# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth of the head from two views: rectified about the head, matched by semi-global matching, checked left against
right.

Hirschmueller, Stereo Processing by Semiglobal Matching (2008); the filter is OpenCV's after Min et al., Fast Global
Smoother (2014). With a guide, a surface that is nearly right, the second picture is first brought over the first by it,
and only what is left is matched: smoothness then favours the guide's slopes, not planes across the view, which cut
noses and fill the creases beside them.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ...geometry.raster import RayCaster, bleed
from ...geometry.views import View

BLOCK_PX = 5
EASY_DEG = 8.0
"""Up to this baseline neighbouring frames look alike; beyond, matching leans more on smoothness, with the square of the
angle up to four times."""
AGREE_PX = 1.0
"""Most a pixel's disparity may differ between the matches from left to right and from right to left."""
GUIDED_PX = 32
"""Disparities that are looked at around a guide's, in pixels."""
GUIDE_STEP_PX = 3
"""Every how many pixels a ray asks for the guide, which is coarse."""
HIDDEN_PX, RIM_PX = 6.0, 4
"""A spot whose disparity the second view's guide contradicts by more is hidden from it; how far beyond its rim a guide
is carried on."""


@dataclass(frozen=True)
class DepthMap:
    """A pinhole camera without distortion and what it sees. rotation [3, 3] and centre [3] (world metres): local =
    rotation @ (world - centre); pixel = focal * (x, y) / z - origin; depth float32 [H, W] along z in metres, nan where
    unknown; disagreement: median left-right difference [px]."""

    rotation: np.ndarray
    centre: np.ndarray
    focal: float
    origin: np.ndarray
    depth: np.ndarray
    baseline: float
    disagreement: float


def match_pair(
    first: View,
    second: View,
    pictures: tuple,
    masks: tuple,
    box: np.ndarray,
    scale: float = 1.0,
    guide: RayCaster | None = None,
) -> DepthMap | None:
    """Depth seen from one of two views. The baseline may have any direction in the picture.

    Parameters
    ----------
    first, second : the views
    pictures : [H, W, 3] each, sRGB
    masks : bool [H, W] each, what may be matched
    box : [2, 3], low and high corner, in metres
    scale : of the pictures that are matched
    guide : a coarser surface, around which depths are looked for

    Returns
    -------
    None where the views share nothing.
    """
    baseline = second.centre - first.centre
    if baseline @ first.rotation[0] < 0:  # so that the rectified pictures stay within 90 degrees of upright
        first, second, pictures, masks, baseline = second, first, pictures[::-1], masks[::-1], -baseline
    rotation = _rectify(baseline, first.axis + second.axis)
    focal = scale * first.camera.mean_focal_length()
    corners = np.stack(np.meshgrid(*box.T), -1).reshape(-1, 3)
    left, right = ((corners - view.centre) @ rotation.T for view in (first, second))
    if min(left[:, 2].min(), right[:, 2].min()) <= 0.02:
        return None
    low, high = (focal * left[:, :2] / left[:, 2:]).min(0), (focal * left[:, :2] / left[:, 2:]).max(0)
    length = np.linalg.norm(baseline)
    nearest, farthest = focal * length / left[:, 2].min(), focal * length / left[:, 2].max()
    count = GUIDED_PX if guide else int(np.ceil((nearest - farthest) / 16 + 0.5)) * 16
    # the right picture reaches `count` pixels further left
    width, height = np.ceil(high - low).astype(int) + (count, 0)
    origin = np.floor(low) - (count, 0)
    expected, seen = (
        _expected(guide, (first.centre, second.centre), rotation, focal, origin, (height, width), length)
        if guide
        else (np.full((height, width), np.floor(farthest), np.float32), np.ones((height, width), bool))
    )
    # a pixel of the second picture lies where the guide expects it, less the smallest disparity that is looked for
    least = -count // 2 if guide else 0
    move = (
        cv2.warpAffine(
            expected, np.float32([[1, 0, least], [0, 1, 0]]), (width, height), borderMode=cv2.BORDER_REPLICATE
        )
        + least
    )
    a, mask_a = warp(first, pictures[0], masks[0], rotation, focal, origin, np.zeros_like(move))
    b, mask_b = warp(second, pictures[1], masks[1], rotation, focal, origin, move)
    mask_a &= seen
    if min(mask_a.sum(), mask_b.sum()) < 500:
        return None
    angle = np.degrees(np.arctan2(length, left[:, 2].mean()))
    stiffness = 1.0 if guide else float(np.clip((angle / EASY_DEG) ** 2, 1, 4))
    disparity, disagreement = _match(a, b, mask_a, mask_b, count, stiffness)
    disparity = np.where(disparity > 0, disparity + least, np.nan)
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    total = disparity + cv2.remap(
        expected, x - np.nan_to_num(disparity).astype(np.float32), y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    depth = np.where(total > 0, focal * length / total, np.nan).astype(np.float32)
    if not np.isfinite(depth).any():
        return None
    return DepthMap(rotation, first.centre, focal, origin, depth, length, disagreement)


def _expected(
    guide: RayCaster,
    centres: tuple,
    rotation: np.ndarray,
    focal: float,
    origin: np.ndarray,
    shape: tuple,
    length: float,
) -> tuple:
    """The guide's disparities float32 [H, W] in the first rectified picture, carried on beyond its rim, and bool [H, W]
    where the second sees them, too."""
    disparity, known = _disparities(guide, centres[0], rotation, focal, origin, shape, length)
    behind = np.array([disparity[known].mean(), 0]) if known.any() else np.zeros(2)
    other, other_known = _disparities(guide, centres[1], rotation, focal, origin - np.round(behind), shape, length)
    x, y = np.meshgrid(np.arange(shape[1], dtype=np.float32), np.arange(shape[0], dtype=np.float32))
    there = cv2.remap(
        other,
        x - disparity + np.round(behind[0]).astype(np.float32),
        y,
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    near = cv2.dilate(known.astype(np.uint8), np.ones((2 * RIM_PX + 1,) * 2, np.uint8)) > 0
    return disparity, near & (np.abs(there - disparity) < HIDDEN_PX)


def _disparities(
    guide: RayCaster,
    centre: np.ndarray,
    rotation: np.ndarray,
    focal: float,
    origin: np.ndarray,
    shape: tuple,
    length: float,
) -> tuple:
    """The guide's disparities float32 [H, W], each pixel off it given its nearest one's, and bool [H, W] where it
    is."""
    y, x = np.mgrid[0 : shape[0] : GUIDE_STEP_PX, 0 : shape[1] : GUIDE_STEP_PX]
    rays = np.stack([(x.ravel() + 0.5 + origin[0]) / focal, (y.ravel() + 0.5 + origin[1]) / focal, np.ones(x.size)], -1)
    norms = np.linalg.norm(rays, axis=1)
    _, _, distance = guide.first_hits(np.repeat(centre[None], len(rays), 0), (rays / norms[:, None]) @ rotation)
    known = np.isfinite(distance).reshape(x.shape)
    disparity = bleed((focal * length / (distance / norms)).reshape(x.shape).astype(np.float32), known)
    fy, fx = np.mgrid[0 : shape[0], 0 : shape[1]].astype(np.float32) / GUIDE_STEP_PX
    return (
        cv2.remap(disparity, fx, fy, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE),
        cv2.remap(known.astype(np.uint8), fx, fy, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE) > 0,
    )


def _rectify(baseline: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Rows: x along the baseline, z as near the viewing axes as may be, y = z x x."""
    x = baseline / np.linalg.norm(baseline)
    z = axis - x * (axis @ x)
    z /= np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z])


def warp(
    view: View,
    picture: np.ndarray,
    mask: np.ndarray,
    rotation: np.ndarray,
    focal: float,
    origin: np.ndarray,
    move: np.ndarray,
) -> tuple:
    """A view through the rectified camera. Lens distortion is taken out on the way.

    Parameters
    ----------
    view : the camera
    picture : [H, W, 3], sRGB
    mask : bool [H, W], what may be matched
    rotation : [3, 3], of the rectified camera
    focal : of it, in pixels
    origin : [2], its principal point is at minus this, in pixels
    move : [h, w], pixels further left at which each pixel is read

    Returns
    -------
    uint8 [h, w, 3] and bool [h, w].
    """
    step = 4  # the lens's map is smooth: computed on a grid, then interpolated
    height, width = move.shape
    first, last = int(np.floor(min(0, -move.max()))), int(np.ceil(width + max(0, -move.min())))
    y, x = np.mgrid[0 : height + step : step, first : last + step : step].astype(np.float64)
    rays = np.stack([(x + 0.5 + origin[0]) / focal, (y + 0.5 + origin[1]) / focal, np.ones_like(x)], -1)
    local = rays.reshape(-1, 3) @ rotation @ view.rotation.T
    local[:, 2] = np.maximum(local[:, 2], 1e-3)
    pixels = np.asarray(view.camera.img_from_cam(local)).reshape(*x.shape, 2).astype(np.float32) - 0.5
    fy, fx = np.mgrid[0:height, 0:width].astype(np.float32)
    maps = cv2.remap(pixels, (fx - move - first) / step, fy / step, cv2.INTER_LINEAR)
    warped = cv2.remap(picture, maps[..., 0], maps[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    inside = cv2.remap(
        mask.astype(np.uint8), maps[..., 0], maps[..., 1], cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT
    )
    return np.round(np.clip(warped, 0, 1) * 255).astype(np.uint8), inside > 0


def _match(
    a: np.ndarray, b: np.ndarray, mask_a: np.ndarray, mask_b: np.ndarray, count: int, stiffness: float
) -> tuple[np.ndarray, float]:
    """Disparities float32 [H, W] of `a` into `b` (0: unknown) and the median disagreement of the two directions."""
    penalty = round(2 * 3 * BLOCK_PX**2 * stiffness)  # a quarter of what is usual: stronger ones flatten the nose
    matcher = cv2.StereoSGBM_create(
        0,
        count,
        BLOCK_PX,
        P1=penalty,
        P2=4 * penalty,
        disp12MaxDiff=-1,
        preFilterCap=31,
        uniquenessRatio=0,
        speckleWindowSize=0,
        speckleRange=0,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )
    back = cv2.ximgproc.createRightMatcher(matcher)
    left, right = matcher.compute(a, b), back.compute(b, a)
    wls = cv2.ximgproc.createDisparityWLSFilter(matcher)
    wls.setLambda(1000.0)
    wls.setSigmaColor(1.2)
    smooth = wls.filter(left, a, disparity_map_right=right).astype(np.float32) / 16
    left, right = left.astype(np.float32) / 16, right.astype(np.float32) / 16
    height, width = left.shape
    x = np.arange(width)[None] - np.round(left).astype(int)
    rows = np.arange(height)[:, None]
    inside = (x >= 0) & (x < width)
    other = np.clip(x, 0, width - 1)
    difference = np.abs(left + right[rows, other])  # the right matcher counts downwards
    seen = inside & mask_a & mask_b[rows, other] & (left > 0)
    good = seen & (difference <= AGREE_PX) & (np.abs(smooth - left) <= AGREE_PX)
    good[:, :count] = False
    good = cv2.morphologyEx(good.astype(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5), np.uint8)) > 0
    return np.where(good, smooth, 0), float(np.median(difference[seen])) if seen.any() else float("nan")
