# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Evidence of a few views as one kind of constraint: a point of the surface should move so far along a direction.

A landmark in a picture constrains the two directions across its ray, a matched point the surface's normal, a silhouette
the normal in the picture.
"""

from dataclasses import dataclass, fields

import numpy as np
from scipy.spatial import cKDTree

from ...geometry.meshes import Mesh, unit, vertex_normals
from ...geometry.views import View
from .alignment import HeadModel
from .landmarks import Landmarks

LEAST_COSINE, FULL_COSINE = 0.15, 0.45
"""Cosines between a landmark's normal and its view: below the first it has slid onto the outline and counts for
nothing, from the second on it counts fully."""
DEPTH_SHARE = 0.06
"""Weight of a depth taken from the mean head beside a landmark's place in the picture: people differ from it by a
centimetre, a network's mark errs by 2.5 mm."""
MOST_ANGLE_DEG = 60.0
"""Maximum angle between a matched point's mean viewing direction and the surface's normal: beyond, the point lies on
something behind."""


@dataclass(frozen=True)
class Constraints:
    """Points of a mesh that should move.

    M points at corners int64 [M, 3] with bary [M, 3] should move by distance [M] (metres) along unit direction [M, 3]
    in the world; weight [M] in [0, 1] relates points of a kind.
    """

    corners: np.ndarray
    bary: np.ndarray
    direction: np.ndarray
    distance: np.ndarray
    weight: np.ndarray

    def __len__(self) -> int:
        return len(self.distance)

    def at(self, vertex_values: np.ndarray) -> np.ndarray:
        """Interpolate values of the vertices [..., V, C] at the points [..., M, C]."""
        return (vertex_values[..., self.corners, :] * self.bary[..., None]).sum(-2)


def join(constraints: list[Constraints]) -> Constraints:
    return Constraints(*(np.concatenate([getattr(part, f.name) for part in constraints]) for f in fields(Constraints)))


def from_landmarks(
    model: HeadModel, vertices: np.ndarray, views: list[View], landmarks: Landmarks, trust: np.ndarray, reach: float
) -> Constraints:
    """Constrain landmarks that are seen squarely enough, in two directions per view.

    A single view does not show depth, so there each landmark is also held, loosely, to the depth it was lifted to.
    vertices [V, 3] in metres are the head's now; a landmark that misses by much more than `reach` metres counts for
    little.
    """
    at = model.at_landmarks(vertices)
    normals = unit(model.at_landmarks(vertex_normals(model.mesh.moved(vertices))))
    corners = model.mesh.faces[model.landmark_face]
    parts = [none()]
    for view in views:
        if view.name not in landmarks.images:
            continue
        pixels, used = landmarks.images[view.name]
        rays = view.rays(pixels)
        towards = unit(view.centre - at)
        facing = np.clip(((normals * towards).sum(1) - LEAST_COSINE) / (FULL_COSINE - LEAST_COSINE), 0, 1)
        weight = facing * used * trust * model.landmark_weight
        index = np.flatnonzero(weight > 0.01)
        along = ((at - view.centre) * rays).sum(1, keepdims=True)
        miss = (view.centre + along * rays - at)[index]
        side = unit(np.cross(rays[index], view.rotation[1]))
        robust = weight[index] / (1 + (miss**2).sum(1) / reach**2) ** 2
        for direction in (side, np.cross(rays[index], side)):
            parts.append(
                Constraints(corners[index], model.landmark_bary[index], direction, (miss * direction).sum(1), robust)
            )
        if len(landmarks.images) == 1:
            deeper = ((landmarks.points[index] - at[index]) * rays[index]).sum(1)
            parts.append(
                Constraints(corners[index], model.landmark_bary[index], rays[index], deeper, DEPTH_SHARE * robust)
            )
    return join(parts)


def from_points(mesh: Mesh, follow: np.ndarray, points: np.ndarray, towards: np.ndarray, reach: float) -> Constraints:
    """Constrain the mesh to matched points [N, 3] near its followed part, on the side that faces their views.

    follow [V] in [0, 1] weighs the vertices; towards [N, 3] is the unit mean direction to the views of a point;
    distances beyond `reach` metres do not count.
    """
    if not len(points):
        return none()
    normals, index = vertex_normals(mesh), np.flatnonzero(follow > 0.02)
    near, nearest = cKDTree(mesh.vertices[index]).query(points, distance_upper_bound=2 * reach)
    in_reach = np.isfinite(near)
    vertex = index[nearest[in_reach]]
    direction = normals[vertex]
    distance = ((points[in_reach] - mesh.vertices[vertex]) * direction).sum(1)
    aside = np.linalg.norm(points[in_reach] - mesh.vertices[vertex] - distance[:, None] * direction, axis=1)
    spacing = np.median(np.linalg.norm(mesh.vertices[mesh.faces[:, 0]] - mesh.vertices[mesh.faces[:, 1]], axis=1))
    facing = (towards[in_reach] * direction).sum(1) > np.cos(np.radians(MOST_ANGLE_DEG))
    good = (np.abs(distance) < reach) & (aside < 3 * spacing) & facing
    weight = np.clip(1 - (distance / reach) ** 2, 0, 1) ** 2 * follow[vertex]
    corners = np.repeat(vertex[:, None], 3, 1)
    bary = np.tile([1.0, 0.0, 0.0], (len(vertex), 1))
    return Constraints(corners[good], bary[good], direction[good], distance[good], weight[good])


def none() -> Constraints:
    return Constraints(np.zeros((0, 3), np.int64), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
