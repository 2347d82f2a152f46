# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth of the head from two views: rectified about the head, matched semi-globally, checked left against right.

Hirschmueller, Stereo Processing by Semiglobal Matching (2008); the filter is OpenCV's after Min et al., Fast Global
Smoother (2014). With a guide, a surface that is nearly right, the second picture is first brought over the first by it,
and only the rest is matched: smoothness then favours the guide's slopes, not planes across the view, which cut noses
and fill the creases beside them.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from ...geometry.raster import RayCaster, bleed
from ...geometry.views import View

BLOCK_PX = 5
EASY_DEG = 8.0
"""Baseline up to which neighbouring frames look alike; beyond, matching leans more on smoothness, with the square of
the angle up to four times."""
AGREE_PX = 1.0
"""Maximum difference of a pixel's disparity between the matches from left to right and from right to left."""
GUIDED_PX = 32  # range of disparities around a guide's
GUIDE_STEP_PX = 3  # pixels between rays to the guide, which is coarse
HIDDEN_PX, RIM_PX = 6.0, 4
"""Disagreement with the second view's guide beyond which a spot is hidden from it, and reach of a guide beyond its
rim."""


@dataclass(frozen=True)
class Pinhole:
    """Camera without distortion.

    local = rotation @ (world - centre), in metres; pixel = focal * (x, y) / z - origin.
    """

    rotation: np.ndarray
    centre: np.ndarray
    focal: float
    origin: np.ndarray

    def rays(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the local directions [..., 3], of depth 1, through the middles of pixels."""
        return np.stack(
            [(x + 0.5 + self.origin[0]) / self.focal, (y + 0.5 + self.origin[1]) / self.focal, np.ones_like(x)], -1
        )


@dataclass(frozen=True)
class DepthMap(Pinhole):
    """Depth float32 [H, W] along z in metres, nan where unknown; disagreement: median left-right difference [px]."""

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
    """Measure depth from one of two views, whose baseline may have any direction; None if they share nothing.

    pictures [H, W, 3] are sRGB, masks bool [H, W] mark what may be matched, box [2, 3] is in metres. Depths are
    searched around the guide, a coarser surface.
    """
    baseline = second.centre - first.centre
    if baseline @ first.rotation[0] < 0:  # keeps rectified pictures within 90 degrees of upright
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
    camera = Pinhole(rotation, first.centre, focal, np.floor(low) - (count, 0))
    if guide:
        expected, visible = _expected(guide, camera, second.centre, (height, width), length)
    else:
        expected = np.full((height, width), np.floor(farthest), np.float32)
        visible = np.ones((height, width), bool)
    # the second picture is read where the guide expects it, shifted by the smallest disparity
    least = -count // 2 if guide else 0
    aside = np.float32([[1, 0, least], [0, 1, 0]])
    move = cv2.warpAffine(expected, aside, (width, height), borderMode=cv2.BORDER_REPLICATE) + least
    a, mask_a = warp(first, pictures[0], masks[0], camera, np.zeros_like(move))
    b, mask_b = warp(second, pictures[1], masks[1], camera, move)
    mask_a &= visible
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
    return DepthMap(rotation, first.centre, focal, camera.origin, depth, length, disagreement)


def _expected(guide: RayCaster, camera: Pinhole, second: np.ndarray, shape: tuple, length: float) -> tuple:
    """Return the guide's disparities float32 [H, W] in the first picture, and where the second sees them, bool [H, W].

    They are continued beyond the guide's rim. second [3] is the other camera's centre, length the baseline's.
    """
    disparity, valid = _disparities(guide, camera, shape, length)
    behind = np.round(np.array([disparity[valid].mean(), 0])) if valid.any() else np.zeros(2)
    other, _ = _disparities(guide, replace(camera, centre=second, origin=camera.origin - behind), shape, length)
    x, y = np.meshgrid(np.arange(shape[1], dtype=np.float32), np.arange(shape[0], dtype=np.float32))
    second_disparity = cv2.remap(
        other, x - disparity + behind[0].astype(np.float32), y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    near = cv2.dilate(valid.astype(np.uint8), np.ones((2 * RIM_PX + 1,) * 2, np.uint8)) > 0
    return disparity, near & (np.abs(second_disparity - disparity) < HIDDEN_PX)


def _disparities(guide: RayCaster, camera: Pinhole, shape: tuple, length: float) -> tuple:
    """Return the guide's disparities float32 [H, W], bled beyond it, and where it is, bool [H, W]."""
    y, x = np.mgrid[0 : shape[0] : GUIDE_STEP_PX, 0 : shape[1] : GUIDE_STEP_PX]
    rays = camera.rays(x.ravel(), y.ravel())
    norms = np.linalg.norm(rays, axis=1)
    origins = np.repeat(camera.centre[None], len(rays), 0)
    _, _, distance = guide.first_hits(origins, (rays / norms[:, None]) @ camera.rotation)
    valid = np.isfinite(distance).reshape(x.shape)
    disparity = bleed((camera.focal * length / (distance / norms)).reshape(x.shape).astype(np.float32), valid)
    fy, fx = np.mgrid[0 : shape[0], 0 : shape[1]].astype(np.float32) / GUIDE_STEP_PX
    return (
        cv2.remap(disparity, fx, fy, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE),
        cv2.remap(valid.astype(np.uint8), fx, fy, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE) > 0,
    )


def _rectify(baseline: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the rows x along the baseline, z as near the viewing axes as may be, y = z x x."""
    x = baseline / np.linalg.norm(baseline)
    z = axis - x * (axis @ x)
    z /= np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z])


def warp(view: View, picture: np.ndarray, mask: np.ndarray, camera: Pinhole, move: np.ndarray) -> tuple:
    """Warp a view without its lens distortion to a rectified camera: uint8 [h, w, 3] and mask bool [h, w].

    Each pixel is read move [h, w] pixels further left.
    """
    step = 4  # the lens's map is smooth: computed on a grid, then interpolated
    height, width = move.shape
    first, last = int(np.floor(min(0, -move.max()))), int(np.ceil(width + max(0, -move.min())))
    y, x = np.mgrid[0 : height + step : step, first : last + step : step].astype(np.float64)
    local = camera.rays(x, y).reshape(-1, 3) @ camera.rotation @ view.rotation.T
    local[:, 2] = np.maximum(local[:, 2], 1e-3)
    pixels = np.asarray(view.camera.img_from_cam(local)).reshape(*x.shape, 2).astype(np.float32) - 0.5
    fy, fx = np.mgrid[0:height, 0:width].astype(np.float32)
    maps = cv2.remap(pixels, (fx - move - first) / step, fy / step, cv2.INTER_LINEAR)
    warped = cv2.remap(picture, maps[..., 0], maps[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    inside = cv2.remap(mask.astype(np.uint8), maps[..., 0], maps[..., 1], cv2.INTER_NEAREST)
    return np.round(np.clip(warped, 0, 1) * 255).astype(np.uint8), inside > 0


def _match(
    a: np.ndarray, b: np.ndarray, mask_a: np.ndarray, mask_b: np.ndarray, count: int, stiffness: float
) -> tuple[np.ndarray, float]:
    """Match `a` into `b`: disparities float32 [H, W] (0: unknown) and the median disagreement of both directions."""
    penalty = round(2 * 3 * BLOCK_PX**2 * stiffness)  # a quarter of the usual: more flattens the nose
    matcher = cv2.StereoSGBM_create(0, count, BLOCK_PX, P1=penalty, P2=4 * penalty, disp12MaxDiff=-1)
    matcher.setPreFilterCap(31)
    matcher.setMode(cv2.STEREO_SGBM_MODE_SGBM_3WAY)
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
    matched = inside & mask_a & mask_b[rows, other] & (left > 0)
    good = matched & (difference <= AGREE_PX) & (np.abs(smooth - left) <= AGREE_PX)
    good[:, :count] = False
    good = cv2.morphologyEx(good.astype(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5), np.uint8)) > 0
    return np.where(good, smooth, 0), float(np.median(difference[matched])) if matched.any() else float("nan")
