# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One camera that another program has solved, as its importer reads it.

As everywhere here, a camera looks along its +z, x to the right, y down; pixel (0.5, 0.5) is the centre of the upper
left one; lens distortion is OpenCV's (COLMAP's FULL_OPENCV: fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath

import numpy as np
import pycolmap

from ...capture.messages import Problem

PIXELS = {"SIMPLE_PINHOLE": 3, "PINHOLE": 4, "SIMPLE_RADIAL": 3, "RADIAL": 3, "OPENCV": 4, "FULL_OPENCV": 4}
"""How many of a model's parameters, from the first, are lengths in pixels."""


@dataclass(frozen=True)
class Calibrated:
    """One camera as another program solved it.

    name: of its picture or of the camera itself; frame: number of the video's frame, or None; model and params:
    COLMAP's, for a picture of width x height pixels, or, if these are 0, with lengths as shares of the picture's longer
    side from its middle; rotation [3, 3] and translation [3]: from the program's world into the camera.
    """

    name: str
    frame: int | None
    model: str
    params: tuple[float, ...]
    width: int
    height: int
    rotation: np.ndarray
    translation: np.ndarray

    def make_camera(self, number: int, width: int, height: int, picture: str = "") -> pycolmap.Camera:
        """Return COLMAP's camera `number` for a picture of another size in pixels.

        Raises Problem, which names the `picture`, if its shape is not the calibration's.
        """
        params = np.array(self.params, float)
        lengths = PIXELS[self.model]
        if not self.width:
            params[:lengths] *= max(width, height)
            params[lengths - 2 : lengths] += width / 2, height / 2
        elif abs(self.width / self.height / (width / height) - 1) > 0.01:
            turned = abs(self.height / self.width / (width / height) - 1) < 0.01
            raise Problem(
                f"The camera of {self.name} was solved for a picture of {self.width} x {self.height} pixels; "
                f"{picture or 'here it'} is {width} x {height}.",
                "Solve the cameras from pictures that were saved upright, without a rotation in their EXIF "
                "data, and give the same ones here."
                if turned
                else "Give the very pictures the cameras were solved from: not cropped, not undistorted.",
            )
        else:
            across, down = width / self.width, height / self.height
            params[:lengths] *= [
                down if i in ((1, lengths - 1) if lengths == 4 else (lengths - 1,)) else across for i in range(lengths)
            ]
        return pycolmap.Camera(camera_id=number, model=self.model, width=width, height=height, params=params)


def rigid(matrix: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return rotation [3, 3] and translation [3] into the camera from its camera-to-world matrix [4, 4].

    A uniform scale of its axes is removed. Raises Problem for any other.
    """
    size = np.linalg.norm(matrix[:3, :3], axis=0)
    if not (np.isfinite(matrix).all() and size.min() > 0 and size.max() / size.min() < 1.001):
        raise Problem(
            f"The camera of {name} is stretched or has no rotation.",
            "Export the cameras again from an object without scale.",
        )
    rotation = (matrix[:3, :3] / size).T
    return rotation, -rotation @ matrix[:3, 3]


def trailing_number(name: str) -> int | None:
    """Return the number at the end of a name without its extension: frame_0012.png -> 12."""
    stem = PurePath(name.replace("\\", "/")).stem
    digits = stem[len(stem.rstrip("0123456789")) :]
    return int(digits) if 0 < len(digits) < 19 else None
