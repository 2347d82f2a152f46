# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""MediaPipe's 468 landmarks on the head: detected in shaded pictures of many identities and views, cast back."""

from __future__ import annotations

import cv2
import numpy as np
import trimesh
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from core.face import faces
from core.geometry.meshes import Mesh, vertex_normals
from core.geometry.raster import RayCaster
from core.imaging import images

# fmt: off
OVAL = (
    10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377, 152, 148, 176, 149, 150,
    136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109,
)
# fmt: on
YAWS_DEG = (-35, -18, 0, 18, 35)  # turns of the head at which the net is asked
IDENTITIES = 6  # heads beside the mean that are drawn and looked at
SIDE_PX, DISTANCE_M, WIDTH_M = 512, 0.7, 0.34  # of a picture, its camera's, and of the plane it shows at the head


def find_landmarks(
    mean: np.ndarray, components: np.ndarray, triangles: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return triangle [468], barycentric [468, 3] and weight [468] in [0, 1] of each landmark on the mean head.

    Left and right are made alike. The first round looks at plain heads, the second at ones with brows and lips painted
    where the first found them. mean [V, 3] and components [K, V, 3], at one deviation, in metres.
    """
    rng = np.random.default_rng(1)
    shapes = [mean] + [
        mean + np.tensordot(rng.normal(0, 0.7, len(components)), components, 1) for _ in range(IDENTITIES)
    ]
    colours = np.tile([0.55, 0.36, 0.28], (len(mean), 1))
    for heads in (shapes[:2], shapes):
        # [views, 468, 3] on the mean head
        observed = np.concatenate([_observe(shape, triangles, colours, mean) for shape in heads])
        points = np.nanmedian(observed, 0)
        partner = _partners(points)
        points = (points + points[partner] * [-1, 1, 1]) / 2
        spread = np.nanmedian(np.linalg.norm(observed - points, axis=-1), 0)
        visible = np.isfinite(observed[..., 0]).mean(0)
        colours = _painted(mean, points)
    triangle, bary = _onto_surface(points, mean, triangles)
    spread = (spread + spread[partner]) / 2
    print(f"landmarks: median spread {np.median(spread) * 1e3:.2f} mm, 90 % {np.quantile(spread, 0.9) * 1e3:.2f} mm")
    weight = np.where((spread < 0.006) & (visible > 0.3), 1 / (1 + (spread / 0.002) ** 2), 0)
    return triangle, np.clip(bary, 0, 1), weight


def _onto_surface(points, vertices, triangles):
    """Return the closest of the triangles around each point's six nearest vertices, and the place in it."""
    _, near = cKDTree(vertices).query(points, 6)
    nearest, bary = np.zeros(len(points), int), np.zeros((len(points), 3))
    for k, point in enumerate(points):
        candidates = np.flatnonzero(np.isin(triangles, near[k]).any(1))
        points = np.repeat(point[None], len(candidates), 0)
        closest = trimesh.triangles.closest_point(vertices[triangles[candidates]], points)
        best = np.argmin(np.linalg.norm(closest - point, axis=1))
        nearest[k] = candidates[best]
        bary[k] = trimesh.triangles.points_to_barycentric(vertices[triangles[nearest[k]]][None], closest[best][None])[0]
    return nearest, bary


def _observe(shape, triangles, colours, mean):
    """Return landmarks from every yaw as positions on the mean head [views, 468, 3]; nan where missed or hidden."""
    mesh = Mesh(shape, triangles)
    caster, normals = RayCaster(mesh), vertex_normals(mesh)
    views = []
    for yaw in YAWS_DEG:
        origin, direction_of = _camera(yaw)
        picture = _shaded(caster, normals, colours, origin, direction_of)
        face = faces.detect(picture)
        if face is None:
            continue
        directions = direction_of(face.landmarks[:, :2])
        triangle, bary, _ = caster.first_hits(np.repeat(origin[None], 468, 0), directions)
        points = (mean[triangles[triangle]] * bary[..., None]).sum(1)
        facing = ((normals[triangles[triangle]] * bary[..., None]).sum(1) * -directions).sum(1) > 0.25
        views.append(np.where(((triangle >= 0) & facing)[:, None], points, np.nan))
    return np.array(views).reshape(-1, 468, 3)


def _camera(yaw: float):
    """Return centre and function from pixels [N, 2] to unit directions of a camera at `yaw` degrees."""
    angle = np.radians(yaw)
    towards = np.array([np.sin(angle), -np.cos(angle), 0.05])
    towards /= np.linalg.norm(towards)
    origin = np.array([0, 0.01, -0.01]) + DISTANCE_M * towards
    right = np.array([np.cos(angle), np.sin(angle), 0])
    up = np.cross(right, -towards)

    def directions(pixels):
        x, y = ((np.asarray(pixels, np.float64) / SIDE_PX - 0.5) * WIDTH_M).T
        rays = -DISTANCE_M * towards + x[:, None] * right - y[:, None] * up
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    return origin, directions


def _shaded(caster, normals, colours, origin, direction_of):
    """Render a Lambert picture, sRGB [SIDE_PX, SIDE_PX, 3]."""
    x, y = np.meshgrid(np.arange(SIDE_PX) + 0.5, np.arange(SIDE_PX) + 0.5)
    directions = direction_of(np.stack([x.ravel(), y.ravel()], -1))
    triangle, bary, _ = caster.first_hits(np.repeat(origin[None], len(directions), 0), directions)
    corners = caster.mesh.faces[triangle]
    normal = (normals[corners] * bary[..., None]).sum(1)
    key = np.array([0.35, -0.75, 0.55]) / np.linalg.norm([0.35, -0.75, 0.55])
    light = 0.75 * np.clip(normal @ key, 0, 1) + 0.2 + 0.15 * np.clip(-(normal * directions).sum(1), 0, 1)
    colour = (colours[corners] * bary[..., None]).sum(1)
    shaded = np.where((triangle >= 0)[:, None], colour * light[:, None], 0.2)
    return images.linear_to_srgb(shaded.reshape(SIDE_PX, SIDE_PX, 3))


def _partners(points):
    """Return the mirror image of each landmark."""
    cost = cdist(points * [-1, 1, 1], points)
    forward = linear_sum_assignment(cost + cost.T)[1]
    return np.where(forward[forward] == np.arange(len(points)), forward, np.argmin(cost, 1))


def _painted(vertices, points):
    """Return linear vertex colours with brows and lips inside the landmarks' outlines, seen from the front."""
    colours = np.tile([0.55, 0.36, 0.28], (len(vertices), 1))
    for outline, colour in [(faces.LIP_LINE, (0.42, 0.14, 0.13)), *((b, (0.08, 0.05, 0.04)) for b in faces.BROW_LINES)]:
        polygon = points[list(outline)][:, [0, 2]].astype(np.float32)
        inside = [
            v[1] < 0.03 and cv2.pointPolygonTest(polygon, (float(v[0]), float(v[2])), False) >= 0 for v in vertices
        ]
        colours[np.array(inside)] = colour
    return colours
