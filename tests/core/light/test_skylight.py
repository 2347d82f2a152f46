# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sky's light on a ball, whose answer is known."""

import numpy as np
import trimesh

from core.geometry.meshes import Mesh
from core.geometry.raster import RayCaster
from core.light.skylight import ambient_occlusion, radiance_transfer
from core.light.spherical_harmonics import LAMBERT, UNIFORM, per_function, sh_basis


def test_the_transfer_of_an_open_ball_is_lamberts_and_nothing_is_occluded():
    ball = trimesh.creation.icosphere(2, radius=0.1)
    normals = ball.vertices / 0.1
    transfer = radiance_transfer(RayCaster(Mesh(ball.vertices, ball.faces)), ball.vertices, normals, rays=512)
    assert np.allclose(transfer, sh_basis(normals) * per_function(LAMBERT), atol=0.03)
    assert np.allclose(UNIFORM * transfer[:, 0], 1, atol=0.03) and np.allclose(
        ambient_occlusion(transfer), 1, atol=0.03
    )
