# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Folder of a COLMAP model, which needs no conversion.

It holds cameras, images and points3D as .bin or .txt, directly or in sparse/, sparse/0/ or 0/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ....capture.messages import Problem
from ....geometry.models import pose_of, read_model
from ..calibrated import PIXELS, Calibrated, trailing_number


def read(folder: Path) -> list[Calibrated]:
    """Read the cameras of a model. Raises Problem if there is none, it is damaged, or a lens is a fisheye."""
    places = [
        folder / subfolder
        for subfolder in (".", "sparse", "sparse/0", "0")
        if any((folder / subfolder / f"images.{kind}").is_file() for kind in ("bin", "txt"))
    ]
    if not places:
        raise Problem(
            f"The folder {folder.name} holds no COLMAP model (cameras.bin and images.bin, or .txt).",
            "Choose the folder that COLMAP wrote; in its window: File, Export model.",
        )
    try:
        model = read_model(places[0])
    except (OSError, ValueError) as error:
        raise Problem(
            f"The COLMAP model in {places[0]} cannot be read ({str(error).splitlines()[0]}).",
            "Export the model again, all its files together.",
        ) from error
    cameras = []
    for image in sorted(model.images.values(), key=lambda image: image.name):
        if not image.has_pose:
            continue
        camera = model.cameras[image.camera_id]
        kind = camera.model.name
        if kind not in PIXELS:
            raise Problem(
                f"The COLMAP model has a lens of kind {kind}, which is not supported.",
                f"Solve it with one of {', '.join(PIXELS)}.",
            )
        pose = pose_of(image)
        cameras.append(
            Calibrated(
                image.name,
                trailing_number(image.name),
                kind,
                tuple(camera.params),
                camera.width,
                camera.height,
                pose.rotation.matrix(),
                np.array(pose.translation),
            )
        )
    return cameras
