# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Roots of hair: densities in hairs per mm^2 over the template's texels, carried to a person's own skin."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from core.face import template
from core.face.strands import Roots
from core.geometry import raster
from core.geometry.meshes import Mesh, unit, vertex_normals

from ..canvas import Canvas, canvas
from ..skin import GROUND
from ..spots import strew


@dataclass(frozen=True)
class Ground:
    """A person's skin under each texel of the canvas of GROUND texels: position [N, 3] in metres, normal [N, 3]."""

    canvas: Canvas
    position: np.ndarray
    normal: np.ndarray


def ground_of(skin: Mesh) -> Ground:
    """Return the ground of a person's closed head, in the template's topology."""
    on, (face, bary) = canvas(GROUND), _texels()
    position, normal = (
        raster.interpolate(values, skin.faces, face, bary) for values in (skin.vertices, vertex_normals(skin))
    )
    return Ground(on, position, unit(normal))


def strew_roots(ground: Ground, density: np.ndarray, way: np.ndarray, spread: float, rng: np.random.Generator) -> Roots:
    """Strew roots of hairs at random.

    density [N]: hairs per mm^2; way [N, 3]: direction of hairs, in the template's axes, any length, flattened onto the
    skin and turned about its normal by a deviation of `spread` radians.
    """
    at, texel = strew(ground.canvas, density, rng)
    offset = (at - ground.canvas.position[texel]) / 1000
    normal = ground.normal[texel]
    position = ground.position[texel] + offset - (offset * normal).sum(1, keepdims=True) * normal
    flat = unit(way[texel] - (way[texel] * normal).sum(1, keepdims=True) * normal)
    turn = rng.normal(0, spread, (len(at), 1))
    return Roots(position, normal, np.cos(turn) * flat + np.sin(turn) * np.cross(normal, flat), at)


@cache
def _texels() -> tuple[np.ndarray, np.ndarray]:
    face, bary = raster.rasterize_uv(template.load(), GROUND)
    covered = face >= 0
    return face[covered], bary[covered]
