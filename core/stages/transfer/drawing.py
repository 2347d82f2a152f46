# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Picture of the delivery for the report."""

import numpy as np

from ...geometry import raster
from ...geometry.meshes import Mesh
from ...geometry.views import View
from ...imaging import images


def draw_scan(mesh: Mesh, textures: tuple, views: list[View], height: int = 420) -> np.ndarray:
    """Draw the most frontal frame, and the scan with each linear texture [S, S, 3] through the same camera."""
    view = min(views, key=lambda view: abs(np.arctan2(view.centre[0], -view.centre[1])))
    frame = view.read()
    width = round(frame.shape[1] * height / frame.shape[0])
    face, bary, _ = raster.render_view(raster.RayCaster(mesh), view, height / view.height)
    uv = raster.interpolate(mesh.uvs, mesh.face_uvs, face, bary).reshape(-1, 2)
    shots = [images.resize(frame, width, height)]
    for texture in textures:
        colour = raster.sample_uv(texture, uv).reshape(*face.shape, -1)
        shot = images.linear_to_srgb(np.where((face >= 0)[..., None], colour, 0.2))
        shots.append(images.resize(shot, width, height))
    return np.hstack(shots)
