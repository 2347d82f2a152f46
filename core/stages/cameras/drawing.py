# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Picture of the solved cameras: the most frontal frame with the head's axes, beside a plan from above."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pycolmap

from ...capture.frame_records import FrameRecord
from ...imaging import images

# colour, tip [m]: left, forward, up
AXES = (((1.0, 0.2, 0.2), (0.1, 0, 0)), ((0.2, 0.9, 0.2), (0, -0.1, 0)), ((0.3, 0.5, 1.0), (0, 0, 0.1)))


def draw_cameras(
    model: pycolmap.Reconstruction, records: Sequence[FrameRecord], folder: Path, height: int = 480
) -> np.ndarray:
    """Draw the world's axes in the most frontal frame, and all cameras from above: sRGB [height, W, 3] in [0, 1]."""
    yaw = {record.name: abs(record.yaw_deg) if record.yaw_deg is not None else 999 for record in records}
    image = min(
        (image for image in model.images.values() if image.has_pose), key=lambda image: yaw.get(image.name, 999)
    )
    return np.concatenate([_axes(model, image, folder, height), _plan(model, height)], 1)


def _axes(model: pycolmap.Reconstruction, image: pycolmap.Image, folder: Path, height: int) -> np.ndarray:
    picture = images.read_srgb(folder / image.name)
    camera, pose = (
        model.cameras[image.camera_id],
        image.cam_from_world() if callable(image.cam_from_world) else image.cam_from_world,
    )
    tips = np.array([(0, 0, 0), *(tip for _, tip in AXES)]) @ pose.rotation.matrix().T + np.asarray(pose.translation)
    pixels = [camera.img_from_cam(tip) if tip[2] > 0 else None for tip in tips]  # None also beyond the lens's view
    reach = 10 * max(picture.shape)  # OpenCV draws no lines that end much farther away
    start, *ends = [
        None if pixel is None or not np.abs(pixel).max() < reach else tuple(int(v) for v in pixel) for pixel in pixels
    ]
    for (colour, _), end in zip(AXES, ends, strict=True):
        if start is None or end is None:
            continue
        cv2.arrowedLine(picture, start, end, colour, max(2, picture.shape[0] // 240), cv2.LINE_AA, tipLength=0.1)
    return images.resize(picture, round(height * picture.shape[1] / picture.shape[0]), height)


def _plan(model: pycolmap.Reconstruction, size: int) -> np.ndarray:
    """Draw the cameras from above: the person's left at the right, the face downwards."""
    centres = np.array([image.projection_center() for image in model.images.values() if image.has_pose])
    reach = 1.3 * np.abs(centres[:, :2]).max()
    plan = np.ones((size, size, 3), np.float32)

    def place(points: np.ndarray) -> np.ndarray:
        return np.round((points[:, :2] * [1, -1] / reach + 1) / 2 * (size - 1)).astype(int)

    points = np.array([point.xyz for point in model.points3D.values()])
    for x, y in place(points[np.abs(points[:, :2]).max(1) < reach]) if len(points) else ():
        plan[y, x] = (0.55, 0.55, 0.55)
    for x, y in place(centres):
        cv2.circle(plan, (int(x), int(y)), 3, (0.9, 0.3, 0.1), -1, cv2.LINE_AA)
    cv2.circle(plan, (size // 2, size // 2), max(2, round(0.08 / reach * size / 2)), (0.2, 0.4, 0.9), 2, cv2.LINE_AA)
    return plan
