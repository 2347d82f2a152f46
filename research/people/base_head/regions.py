# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The head's regions: the face's outline on the surface, and the UV masks, drawn through landmarks."""

from __future__ import annotations

import cv2
import numpy as np
import trimesh
from scipy.spatial import cKDTree

from core.face.faces import BROW_LINES, EYE_LINES, LIP_LINE
from core.geometry.meshes import Mesh, vertex_normals
from core.geometry.raster import RayCaster, bleed, interpolate, rasterize_uv

from .marks import OVAL

MASK_SIZE = 1024  # texels along a side
_NOSE = (168, 417, 465, 343, 437, 420, 279, 358, 327, 326, 2, 97, 98, 129, 49, 198, 217, 114, 245, 193)


def face_outline(points: np.ndarray) -> np.ndarray:
    """Return the face's outline [72, 2] in `around`'s coordinates.

    The hull of MediaPipe's oval, a little higher on the forehead and fuller under the chin.
    """
    outline = cv2.convexHull(around(points[list(OVAL)]).astype(np.float32))[:, 0].astype(np.float64)
    outline = _resampled(outline, 72)
    outline = (outline + np.roll(outline, 1, 0) + np.roll(outline, -1, 0)) / 3
    middle = outline.mean(0)
    up = np.clip((outline[:, 1] - 0.02) / 0.03, 0, 1)
    return middle + (outline - middle) * [1.03, 1.03] + np.stack([0 * up, 0.010 * up], -1)


def _resampled(outline: np.ndarray, count: int) -> np.ndarray:
    closed = np.concatenate([outline, outline[:1]])
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    at = np.arange(count) / count * length[-1]
    return np.stack([np.interp(at, length, closed[:, axis]) for axis in range(2)], -1)


def around(points: np.ndarray) -> np.ndarray:
    """Map [..., 3] to cylinder coordinates [..., 2] in metres: angle about the vertical axis times 0.08, and height."""
    return np.stack([np.arctan2(points[..., 0], 0.05 - points[..., 1]) * 0.08, points[..., 2]], -1)


def distance_inside(points: np.ndarray, outline: np.ndarray) -> np.ndarray:
    """Return signed distances [N] in metres of points [N, 3] to an outline in `around`'s coordinates.

    Positive inside.
    """
    polygon = outline.astype(np.float32)
    return np.array([cv2.pointPolygonTest(polygon, (float(a), float(b)), True) for a, b in around(points)])


def choose_scale(vertices: np.ndarray, faces: np.ndarray, outline: np.ndarray, share: float = 0.70) -> np.ndarray:
    """Return UV length per metre [F]: a share of the unit square for the face, the rest for everything else.

    Blended over 12 mm outside the face's outline [P, 2] (in `around`'s coordinates). vertices [V, 3] in metres; faces
    [F, 3].
    """
    centres = vertices[faces].mean(1)
    inside = distance_inside(centres, outline)
    blend = np.clip(1 + inside / 0.012, 0, 1)
    area = trimesh.triangles.area(vertices[faces])
    in_face = inside > 0
    # the nose and lips stand out of the surface: a face texel is worth the same everywhere
    face_scale = np.sqrt(share / area[in_face].sum())
    low, high = 0.0, face_scale
    for _ in range(60):
        other = (low + high) / 2
        scale = face_scale**blend * other ** (1 - blend)
        low, high = (other, high) if (area * scale**2).sum() < 1 else (low, other)
    return scale


def draw_masks(mesh: Mesh, points: np.ndarray) -> dict[str, np.ndarray]:
    """Return soft masks [S, S] in [0, 1] by name; `points` [468, 3] are the landmarks on the surface."""
    size = MASK_SIZE
    face, bary = rasterize_uv(mesh, size)
    position = bleed(interpolate(mesh.vertices, mesh.faces, face, bary), face >= 0)
    uv = position_to_texel(mesh, points, size)
    outline = face_outline(points)
    signed = distance_inside(position.reshape(-1, 3), outline).reshape(size, size)
    x, y, z = np.moveaxis(position, -1, 0)
    # the surface stands out sideways at the height of the ears
    ears = (np.abs(x) > 0.0745) & (y > 0.052) & (y < 0.115) & (z > -0.06) & (z < 0.035)
    ears = _connected(ears)
    # a slanted plane from under the chin to the nape
    below = np.clip((-0.075 - 0.55 * y + 0.028 - z) / 0.003, 0, 1)
    masks = {"face": np.clip(signed / 0.0015 + 0.5, 0, 1) * (1 - ears)}
    masks["lips"] = _filled(uv[list(LIP_LINE)], size)
    masks["brows"] = np.maximum(*(_filled(uv[list(b)], size, grow=6) for b in BROW_LINES))
    masks["eyes"] = np.maximum(*(_filled(uv[list(e)], size, grow=14) for e in EYE_LINES))
    masks["nose"] = _filled(cv2.convexHull(uv[list(_NOSE)].astype(np.float32))[:, 0], size)
    masks["nostrils"] = _nostrils(mesh, position, masks["nose"])
    masks["ears"] = ears
    masks["neck"] = below * (1 - masks["face"]) * (1 - ears)
    masks["scalp"] = (1 - masks["face"]) * (1 - ears) * (1 - below)
    cover = np.maximum.reduce([masks[n] for n in ("lips", "brows", "nostrils")])
    masks["skin"] = masks["face"] * (1 - cover)
    return {name: ((mask + mask[:, ::-1]) / 2).astype(np.float32) for name, mask in masks.items()}


def position_to_texel(mesh: Mesh, points: np.ndarray, size: int) -> np.ndarray:
    """Return texel coordinates [N, 2] (x, y) of points on the surface, by their nearest vertices."""
    flat = np.unique(np.stack([mesh.faces.ravel(), mesh.face_uvs.ravel()], -1), axis=0)
    tree = cKDTree(mesh.vertices[flat[:, 0]])
    distance, index = tree.query(points, 3)
    weight = 1 / np.maximum(distance, 1e-6) ** 2
    uv = (mesh.uvs[flat[index, 1]] * weight[..., None]).sum(1) / weight.sum(1, keepdims=True)
    return np.stack([uv[:, 0] * size - 0.5, (1 - uv[:, 1]) * size - 0.5], -1)


def _filled(outline: np.ndarray, size: int, grow: int = 0) -> np.ndarray:
    """Fill an outline [N, 2] in texels, antialiased and softened a little."""
    mask = np.zeros((size, size), np.uint8)
    cv2.fillPoly(mask, [np.round(outline * 16).astype(np.int32)], 255, cv2.LINE_AA, 4)
    if grow:
        mask = cv2.dilate(mask, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * grow + 1,) * 2))
    return cv2.GaussianBlur(mask, (0, 0), 1.5).astype(np.float32) / 255


def _connected(mask: np.ndarray) -> np.ndarray:
    """Close holes, remove specks, soften the edge."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (9, 9))
    closed = cv2.morphologyEx(mask.astype(np.uint8) * 255, cv2.MORPH_CLOSE, disc)
    closed = cv2.morphologyEx(closed, cv2.MORPH_OPEN, disc)
    return cv2.GaussianBlur(cv2.dilate(closed, disc), (0, 0), 2).astype(np.float32) / 255


def _nostrils(mesh: Mesh, position: np.ndarray, nose: np.ndarray) -> np.ndarray:
    """Mark texels within the nose's outline from which less than a third of the frontal directions are free."""
    rng = np.random.default_rng(0)
    near = np.linalg.norm(mesh.vertices - position[nose > 0.9].mean(0), axis=1) < 0.04
    index = np.flatnonzero(near)
    normals = vertex_normals(mesh)
    caster, free = RayCaster(mesh), np.zeros(len(index))
    for _ in range(48):
        direction = rng.normal(size=3)
        direction *= -np.sign(direction[1]) / np.linalg.norm(direction)
        rays = np.repeat(direction[None], len(index), 0)
        free += ~caster.blocked(mesh.vertices[index] + 3e-4 * normals[index], rays)
    dark = np.zeros(len(mesh.vertices))
    dark[index] = np.clip((0.36 - free / 48) / 0.08, 0, 1)
    face, bary = rasterize_uv(mesh, len(nose))
    picture = interpolate(dark[:, None], mesh.faces, face, bary)[..., 0].astype(np.float32)
    return cv2.GaussianBlur(picture, (0, 0), 2) * (nose > 0.05)
