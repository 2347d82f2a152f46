# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw the report's pictures of the whole head, from where no camera stood, and of the hair."""

from __future__ import annotations

import numpy as np

from ...geometry import raster, surfaces
from ...geometry.meshes import vertex_normals
from ...imaging import images
from .hair import Hair
from .maps import HeadMaps
from .surface import HeadSurface

VIEW_DIRECTIONS = (1, 0.1, 0), (0.25, 1, 0.2), (0.35, -0.6, -0.75)  # from the left, the back, below
# directions (right, up, towards the eye) and strengths
LAMPS = (((0.8, 0.6, 1.0), 1.5), ((-1.2, 0.0, 0.5), 0.7), ((-0.2, 1.0, 0.2), 0.5))
AMBIENT, GROUND = 0.15, 0.06
REACH_MM = 165.0  # from the middle of a picture to its edge
SHININESS = 40  # exponent of Blinn's highlight
TINTS = {"brows": (1.0, 0.1, 0.1), "lashes": (0.1, 0.9, 0.2), "beard": (0.1, 0.35, 1.0)}  # sRGB of the hairs, by growth
FACE_EXTENT = 0.04, 0.96  # rows and columns of the map that the face fills


def draw_turned(surface: HeadSurface, several: list[HeadMaps], side: int = 240) -> np.ndarray:
    """Return an sRGB picture: a row for each of `several`, the head from VIEW_DIRECTIONS under three lamps."""
    mesh = surface.mesh
    caster, normals, tangent = raster.RayCaster(mesh), vertex_normals(mesh), surfaces.tangents(mesh)
    columns = []
    for direction in VIEW_DIRECTIONS:
        towards, right, up = _axes(direction)
        row, column = np.mgrid[0:side, 0:side]
        across, along = ((at + 0.5) / side * 2 * REACH_MM - REACH_MM for at in (column, side - 1 - row))
        middle = (mesh.vertices.max(0) + mesh.vertices.min(0)) / 2
        origins = middle + 500 * towards + across[..., None] * right + along[..., None] * up
        face, bary, _ = caster.first_hits(origins.reshape(-1, 3), np.repeat(-towards[None], side * side, 0))
        hit = face >= 0
        axes = surfaces.frames(normals, mesh.faces, *tangent, face[hit], bary[hit])
        uv = (mesh.uvs[mesh.face_uvs[face[hit]]] * bary[hit][..., None]).sum(1)
        pictures = []
        for maps in several:
            picture = np.full((side * side, 3), GROUND)
            picture[hit] = _lit(maps, np.stack([uv[:, 0], 1 - uv[:, 1]], 1) * surface.size, axes, (right, up, towards))
            pictures.append(picture.reshape(side, side, 3))
        columns.append(np.vstack(pictures))
    return images.linear_to_srgb(np.hstack(columns))


def draw_masks(diffuse: np.ndarray, hair: Hair, cleaned: np.ndarray, side: int = 400) -> np.ndarray:
    """Return sRGB [side, 3 side, 3]: the face's albedo, its brows red, lashes green and beard blue, the skin below."""
    tinted = images.linear_to_srgb(diffuse) * 0.6
    for name, tint in TINTS.items():
        cover = getattr(hair, name)[..., None]
        tinted = tinted * (1 - cover) + np.float32(tint) * cover
    first, last = (round(share * len(diffuse)) for share in FACE_EXTENT)
    inner = np.s_[first:last, first:last]
    pictures = images.linear_to_srgb(diffuse), tinted, images.linear_to_srgb(cleaned)
    return np.hstack([images.resize(picture[inner], side, side) for picture in pictures])


def _axes(direction) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return unit vectors towards the eye, to the picture's right, and up."""
    towards = np.asarray(direction, float) / np.linalg.norm(direction)
    right = np.cross([0, 0, 1.0], towards)
    right /= np.linalg.norm(right)
    return towards, right, np.cross(towards, right)


def _lit(maps: HeadMaps, texel: np.ndarray, axes, eye) -> np.ndarray:
    """Return linear colours [N, 3] at texels [N, 2] with tangent frames `axes`, by Lambert with Blinn's highlights."""
    albedo, tilted, level = (raster.sample(picture, texel) for picture in (maps.diffuse, maps.normal, maps.specular))
    normal = sum(tilted[:, i : i + 1] * axis for i, axis in enumerate(axes))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    colour = AMBIENT * albedo
    for place, strength in LAMPS:
        lamp = sum(share * axis for share, axis in zip(place, eye, strict=True))
        lamp = lamp / np.linalg.norm(lamp)
        half = (lamp + eye[2]) / np.linalg.norm(lamp + eye[2])
        shine = level * np.clip(normal @ half, 0, 1) ** SHININESS
        colour = colour + strength * np.clip(normal @ lamp, 0, None)[:, None] * (albedo + shine[:, None])
    return colour
