# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth of the head from two views: rectified about the head, matched by semi-global matching, checked left against right.

Hirschmueller, Stereo Processing by Semiglobal Matching (2008); the filter is OpenCV's after Min et al., Fast Global Smoother (2014).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ..views import View

BLOCK = 5
EASY_DEG = 8.0
"""Up to this baseline neighbouring frames look alike; beyond, matching leans more on smoothness, with the square of the angle up to four times."""
AGREE_PX = 1.0
"""Most a pixel's disparity may differ between the matches from left to right and from right to left."""


@dataclass(frozen=True)
class DepthMap:
    """A pinhole camera without distortion and what it sees. rotation [3, 3] and centre [3] (world metres): local = rotation @ (world - centre);
    pixel = focal * (x, y) / z - origin; depth float32 [H, W] along z in metres, nan where unknown; disagreement: median left-right difference [px]."""

    rotation: np.ndarray
    centre: np.ndarray
    focal: float
    origin: np.ndarray
    depth: np.ndarray
    baseline: float
    disagreement: float


def match_pair(first: View, second: View, pictures: tuple, masks: tuple, box: np.ndarray, scale: float = 1.0) -> DepthMap | None:
    """Depth seen from one of two views within the box [2, 3] (low and high corner, world metres); None where they share nothing.

    pictures: sRGB [H, W, 3]; masks: bool [H, W] of what may be matched. The baseline may have any direction in the picture.
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
    count = int(np.ceil((nearest - farthest) / 16 + 0.5)) * 16
    width, height = np.ceil(high - low).astype(int) + (count, 0)  # the right picture reaches `count` pixels further left
    origin = np.floor(low) - (count, 0)
    shift = np.floor(farthest)  # disparities start here
    a, mask_a = _warp(first, pictures[0], masks[0], rotation, focal, origin, width, height)
    b, mask_b = _warp(second, pictures[1], masks[1], rotation, focal, origin - (shift, 0), width, height)
    if min(mask_a.sum(), mask_b.sum()) < 500:
        return None
    angle = np.degrees(np.arctan2(length, left[:, 2].mean()))
    disparity, disagreement = _match(a, b, mask_a, mask_b, count, float(np.clip((angle / EASY_DEG) ** 2, 1, 4)))
    depth = np.where(disparity > 0, focal * length / (disparity + shift), np.nan).astype(np.float32)
    return DepthMap(rotation, first.centre, focal, origin, depth, length, disagreement)


def _rectify(baseline: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Rows: x along the baseline, z as near the viewing axes as may be, y = z x x."""
    x = baseline / np.linalg.norm(baseline)
    z = axis - x * (axis @ x)
    z /= np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z])


def _warp(view: View, picture: np.ndarray, mask: np.ndarray, rotation: np.ndarray, focal: float, origin: np.ndarray, width: int, height: int) -> tuple:
    """The view through the rectified camera: uint8 [height, width, 3] and bool [height, width]. Lens distortion is taken out on the way."""
    step = 4  # the map is smooth: computed on a grid, then interpolated
    y, x = np.mgrid[0:height + step:step, 0:width + step:step].astype(np.float64)
    local = np.stack([(x + 0.5 + origin[0]) / focal, (y + 0.5 + origin[1]) / focal, np.ones_like(x)], -1).reshape(-1, 3) @ rotation @ view.rotation.T
    local[:, 2] = np.maximum(local[:, 2], 1e-3)
    pixels = np.asarray(view.camera.img_from_cam(local)).reshape(*x.shape, 2).astype(np.float32) - 0.5
    fy, fx = np.mgrid[0:height, 0:width].astype(np.float32) / step
    maps = cv2.remap(pixels, fx, fy, cv2.INTER_LINEAR)
    warped = cv2.remap(picture, maps[..., 0], maps[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    inside = cv2.remap(mask.astype(np.uint8), maps[..., 0], maps[..., 1], cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT)
    return np.round(np.clip(warped, 0, 1) * 255).astype(np.uint8), inside > 0


def _match(a: np.ndarray, b: np.ndarray, mask_a: np.ndarray, mask_b: np.ndarray, count: int, stiffness: float) -> tuple[np.ndarray, float]:
    """Disparities float32 [H, W] of `a` into `b` (0: unknown) and the median disagreement of the two directions."""
    penalty = round(2 * 3 * BLOCK**2 * stiffness)  # a quarter of what is usual: stronger ones flatten the nose
    matcher = cv2.StereoSGBM_create(0, count, BLOCK, P1=penalty, P2=4 * penalty, disp12MaxDiff=-1, preFilterCap=31,
                                    uniquenessRatio=0, speckleWindowSize=0, speckleRange=0, mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY)
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
