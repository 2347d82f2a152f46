# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's cameras as JSON, as the add-on writes them from a scene.

    {"width": 720, "height": 960, "focal_px": 933.3,
     "cameras": [{"frame": 0 and/or "name": "IMG_0001", "matrix_world": [[4 numbers] x 4], and, where they differ,
                  "focal_px", "centre_px": [x, y], "width", "height"}, ...]}

matrix_world is Blender's own: camera to world, row by row, the camera looking along its -z, y up. Pixels from the upper
left corner, centres at +0.5.
"""

from __future__ import annotations

import numpy as np

from ....capture.json_files import parse_json
from ....capture.messages import Problem
from ..calibrated import Calibrated, rigid, trailing_number


def read(text: str, name: str) -> list[Calibrated]:
    """Read Blender's cameras. Raises Problem for other JSON, or a camera with missing numbers."""
    try:
        record = parse_json(text)
    except ValueError as error:
        raise Problem(f"{name} is damaged ({error}).", "Write the cameras from Blender again.") from error
    if not isinstance(record, dict) or not isinstance(record.get("cameras"), list):
        raise Problem(
            f"{name} is a JSON file, but not a list of Blender's cameras.",
            "Write the cameras from Blender's scene with the add-on.",
        )
    cameras = []
    for index, camera in enumerate(record["cameras"]):
        label = str(camera.get("name", camera.get("frame", index))) if isinstance(camera, dict) else str(index)
        try:
            width, height = (int(camera.get(key, record.get(key))) for key in ("width", "height"))
            focal = float(camera.get("focal_px", record.get("focal_px")))
            centre = [float(x) for x in camera.get("centre_px", (width / 2, height / 2))]
            matrix = np.array(camera["matrix_world"], float).reshape(4, 4) @ np.diag([1.0, -1.0, -1.0, 1.0])
            frame = int(camera["frame"]) if "frame" in camera else trailing_number(label)
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise Problem(
                f"Camera {label} in {name} is incomplete ({error}).",
                "Each camera needs matrix_world and, once or for each, width, height, focal_px.",
            ) from error
        cameras.append(
            Calibrated(label, frame, "PINHOLE", (focal, focal, *centre), width, height, *rigid(matrix, label))
        )
    return cameras
