# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where hair takes root: densities in hairs per mm^2 over the template's texels, carried to a person's own skin."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from core.face import template
from core.face.strands import Roots
from core.geometry import raster
from core.geometry.meshes import Mesh, vertex_normals

from ..canvas import Canvas, canvas
from ..skin import GROUND
from ..spots import strew


@dataclass(frozen=True)
class Ground:
    """position [N, 3] metres and normal [N, 3] of a person's skin under each texel of the template's canvas of GROUND
    texels."""

    canvas: Canvas
    position: np.ndarray
    normal: np.ndarray


def ground_of(skin: Mesh) -> Ground:
    """Of a person's closed head, in the template's topology."""
    on, (face, bary) = canvas(GROUND), _texels()
    normals = raster.interpolate(vertex_normals(skin), skin.faces, face, bary)
    return Ground(
        on,
        raster.interpolate(skin.vertices, skin.faces, face, bary),
        normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9),
    )


def strew_roots(ground: Ground, density: np.ndarray, way: np.ndarray, rng: np.random.Generator) -> Roots:
    """Roots of hairs, strewn over the skin at random.

    Parameters
    ----------
    ground : of the head
    density : [N], hairs per mm^2
    way : [N, 3], along which hairs lie: the template's axes, any length, flattened onto the skin
    rng : of their places
    """
    at, texel = strew(ground.canvas, density, rng)
    offset = (at - ground.canvas.position[texel]) / 1000
    normal = ground.normal[texel]
    position = ground.position[texel] + offset - (offset * normal).sum(1, keepdims=True) * normal
    return Roots(position, normal, _flat(way[texel], normal), at)


def turned(roots: Roots, radians: np.ndarray) -> Roots:
    """The same roots with their directions turned about the skin's normal by `radians` [M]."""
    c, s = np.cos(radians)[:, None], np.sin(radians)[:, None]
    return Roots(
        roots.position, roots.normal, c * roots.direction + s * np.cross(roots.normal, roots.direction), roots.at
    )


def _flat(way: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The part of directions [M, 3] across the normals [M, 3], unit."""
    flat = way - (way * normal).sum(1, keepdims=True) * normal
    return flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-9)


@cache
def _texels() -> tuple[np.ndarray, np.ndarray]:
    face, bary = raster.rasterize_uv(template.load(), GROUND)
    covered = face >= 0
    return face[covered], bary[covered]
