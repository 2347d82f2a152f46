# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An egg with UVs, for what works on any mesh.

U runs around the egg, 0.5 at the face (-Y), larger towards the person's left (+X); V from the bottom to the top.
"""

import numpy as np

from core.geometry.meshes import Mesh

RADII = np.array([0.075, 0.095, 0.120])


def egg(columns: int = 96, rows: int = 64) -> Mesh:
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0.02, 0.98, rows + 1))
    azimuth, height = (u - 0.5) * 2 * np.pi, (v - 0.5) * np.pi
    directions = np.stack([np.sin(azimuth) * np.cos(height), -np.cos(azimuth) * np.cos(height), np.sin(height)], -1)
    index = np.arange(u.size).reshape(u.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return Mesh((directions * RADII).reshape(-1, 3), faces, np.stack([u, v], -1).reshape(-1, 2), faces)
