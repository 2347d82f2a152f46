# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion while a phone films: the head's sway, the smear of an exposure, rows read one after the other."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from core.geometry import raster
from core.geometry.views import View

PIVOT = np.array([0.0, 0.08, -0.16])  # of the head's turning: the neck, metres
PERIOD = 14  # frames over which the sway is alike
TAPS = 9
FAR_M = 1.6  # what is behind the person


def sample_sway(frames: int, millimetres: float, degrees: float, rng: np.random.Generator) -> np.ndarray:
    """Draw head-to-world matrices [frames, 4, 4] in metres of a person who keeps still as well as people do.

    Smooth motion of mean zero about the neck; deviations per axis in millimetres and degrees.
    """
    path = gaussian_filter1d(rng.normal(size=(frames + 8 * PERIOD, 6)), PERIOD, axis=0)[4 * PERIOD : -4 * PERIOD]
    path = (path - path.mean(0)) / np.maximum(path.std(0), 1e-9)
    turn = Rotation.from_rotvec(np.radians(degrees) * path[:, :3]).as_matrix()
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, :3, :3] = turn
    poses[:, :3, 3] = PIVOT - turn @ PIVOT + millimetres / 1000 * path[:, 3:]
    return poses


def measure_image_motion(caster: raster.RayCaster, views: tuple[View, View, View], poses: np.ndarray) -> np.ndarray:
    """Return the motion of each pixel of the middle view in a frame's time, float32 [H, W, 2] in pixels.

    All but the head stands still. caster: of the head, in its own axes; views: of the frame before, this one and the
    one after, in the world; poses [3, 4, 4]: head to world. Computed at an eighth
    of the size.
    """
    before, now, after = views
    width, height = round(now.width / 8), round(now.height / 8)
    y, x = np.mgrid[0:height, 0:width]
    pixels = (np.stack([x.ravel(), y.ravel()], -1) + 0.5) * [now.width / width, now.height / height]
    rays = now.rays(pixels)
    back = np.linalg.inv(poses[1])
    _, _, depth = caster.first_hits(
        np.repeat((back[:3, :3] @ now.centre + back[:3, 3])[None], len(rays), 0), rays @ back[:3, :3].T
    )
    head = np.isfinite(depth)
    points = now.centre + rays * np.where(head, depth, FAR_M)[:, None]
    ends = []
    for view, pose in ((before, poses[0]), (after, poses[2])):
        step = pose @ back
        ends.append(view.project(np.where(head[:, None], points @ step[:3, :3].T + step[:3, 3], points))[0])
    flow = ((ends[1] - ends[0]) / 2).reshape(height, width, 2).astype(np.float32)
    return cv2.resize(flow, (now.width, now.height), interpolation=cv2.INTER_LINEAR)


def rolling_shutter(picture: np.ndarray, flow: np.ndarray, readout: float) -> np.ndarray:
    """Read a picture's rows during `readout` of a frame's time, the middle one on time.

    picture [H, W, C]; flow [H, W, 2] in pixels per frame.
    """
    rows = (np.arange(len(picture)) + 0.5) / len(picture) - 0.5
    return shifted(picture, flow * (readout * rows)[:, None, None])


def motion_blur(picture: np.ndarray, flow: np.ndarray, shutter: float) -> np.ndarray:
    """Average a picture [H, W, C] along the flow [H, W, 2] over an exposure of `shutter` of a frame's time."""
    times = shutter * (np.arange(TAPS) + 0.5 - TAPS / 2) / TAPS
    return np.mean([shifted(picture, flow * t) for t in times], axis=0, dtype=np.float32)


def shifted(picture: np.ndarray, by: np.ndarray) -> np.ndarray:
    """Move what is at x to x + by, [H, W, 2] in pixels."""
    y, x = np.mgrid[0 : picture.shape[0], 0 : picture.shape[1]]
    from_x, from_y = (x - by[..., 0]).astype(np.float32), (y - by[..., 1]).astype(np.float32)
    return cv2.remap(picture, from_x, from_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).reshape(picture.shape)
