# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Calibrated views: the frames with their cameras, as every stage after `cameras` reads them.

A COLMAP camera looks along its +z, x to the right, y down; pixel (0.5, 0.5) is the centre of the upper left one.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pycolmap

from ..capture.capture import Capture
from ..capture.frame_records import read_frames
from ..capture.json_files import plain_name
from ..capture.messages import Problem
from ..capture.stages import advise_again
from ..imaging import images
from .models import pose_of, read_model


@dataclass(frozen=True)
class View:
    """A registered frame. rotation [3, 3] and translation [3] take world points (metres) into the camera."""

    name: str
    path: Path
    camera: pycolmap.Camera
    rotation: np.ndarray
    translation: np.ndarray
    selected: bool

    @property
    def width(self) -> int:
        return self.camera.width

    @property
    def height(self) -> int:
        return self.camera.height

    @property
    def centre(self) -> np.ndarray:
        """Centre of projection in the world [3], metres."""
        return -self.rotation.T @ self.translation

    @property
    def axis(self) -> np.ndarray:
        """Unit viewing direction in the world [3]."""
        return self.rotation[2]

    def read(self) -> np.ndarray:
        """Return the picture, sRGB [H, W, 3]. Raises Problem if it cannot be read, or is not the camera's size."""
        picture = images.read_srgb(self.path)
        height, width = picture.shape[:2]
        if (width, height) != (self.width, self.height):
            raise Problem(
                f"{self.path} is {width} x {height}, but its camera was solved for {self.width} x {self.height}.",
                advise_again("frames"),
            )
        return picture

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Project world points [N, 3] to pixels [N, 2] and depths [N] in metres.

        Lens distortion is applied; pixels are nan behind the camera.
        """
        local = np.asarray(points, np.float64) @ self.rotation.T + self.translation
        depth = local[:, 2]
        pixels = np.full((len(local), 2), np.nan)
        front = depth > 1e-6
        if front.any():
            pixels[front] = self.camera.img_from_cam(local[front])
        return pixels, depth

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Return unit directions in the world [N, 3] from `centre` through pixels [N, 2]."""
        plane = np.asarray(self.camera.cam_from_img(np.asarray(pixels, np.float64)))
        directions = np.concatenate([plane, np.ones((len(plane), 1))], 1) @ self.rotation
        return directions / lengths(directions)[:, None]


def lengths(vectors: np.ndarray) -> np.ndarray:
    """Return the lengths of vectors [..., 2 or 3]: np.linalg.norm to the last bit, in a third of its time."""
    return np.sqrt(sum((vectors[..., k] ** 2 for k in range(1, vectors.shape[-1])), vectors[..., 0] ** 2))


def read_points(capture: Capture) -> tuple[np.ndarray, np.ndarray]:
    """Return matched points [N, 3] in metres, and unit mean directions [N, 3] to the cameras that saw them.

    Raises Problem as `read_views` does.
    """
    model = _read_model(capture)
    centres = {
        number: np.asarray(image.projection_center()) for number, image in model.images.items() if image.has_pose
    }
    places = np.array([point.xyz for point in model.points3D.values()]).reshape(-1, 3)
    towards = np.zeros_like(places)
    for i, point in enumerate(model.points3D.values()):
        cameras = [centres[element.image_id] for element in point.track.elements if element.image_id in centres]
        rays = np.array(cameras).reshape(-1, 3) - places[i]
        towards[i] = (rays / np.maximum(np.linalg.norm(rays, axis=1, keepdims=True), 1e-9)).sum(0)
    return places, towards / np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-9)


def read_views(capture: Capture, selected_only: bool = False) -> list[View]:
    """Return the registered frames in order. Raises Problem if frames or cameras are missing or damaged."""
    frames = read_frames(capture).by_name
    model = _read_model(capture)
    views = []
    for image in sorted(model.images.values(), key=lambda image: image.name):
        frame = frames.get(image.name)
        if frame is None or (selected_only and not frame.selected) or not image.has_pose:
            continue
        pose = pose_of(image)
        views.append(
            View(
                image.name,
                capture.frames / image.name,
                model.cameras[image.camera_id],
                pose.rotation.matrix(),
                np.array(pose.translation),
                frame.selected,
            )
        )
    return views


def _read_model(capture: Capture) -> pycolmap.Reconstruction:
    try:
        model = read_model(capture.cameras)
        strange = [image.name for image in model.images.values() if not plain_name(image.name)]
        if strange:
            raise ValueError(f"{strange[0]!r} is no name of a frame")
    except (OSError, ValueError) as error:
        raise Problem(f"The cameras of this capture cannot be read ({error}).", advise_again("frames")) from error
    return model
