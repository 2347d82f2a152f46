# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scan for delivery: fewer triangles, UVs, its colours as filmed, and the albedo where the head's maps reach.

The scan has hair, ears and clothes as they were seen, which the registered head does not.
"""

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
import trimesh

from ...geometry import atlas, raster, surfaces
from ...geometry.baking import STRIP_ROWS, TexelPartners
from ...geometry.meshes import Mesh, unit, vertex_normals
from ...geometry.views import View
from ...imaging import images

LEAST_PART_SHARE = 0.02  # share of all triangles under which a loose part is dropped as a floater
STEP_M = 0.003  # distance behind a view's surface at which a point still counts as seen: the scan's noise
COSINE_POWER = 6
"""Power of the cosine between a view and the surface: the frontal view wins, its neighbours hide the borders."""
FAR_M = 0.010  # maximum distance between head and scan to transfer from one to the other
FADE_PX = 6  # width at 1024 over which the displacement ends where the scan ends


def reduce(scan: Mesh, cell: float) -> Mesh:
    """Cluster the scan's vertices in cubes of side `cell` (metres), and drop floaters.

    Rossignac and Borrel 1993: a vertex is the mean of those in its cube. The scan's own noise allows it, and it takes a
    tenth of a second.
    """
    place = np.floor((scan.vertices - scan.vertices.min(0)) / cell).astype(np.int64)
    _, cluster, count = np.unique(place, axis=0, return_inverse=True, return_counts=True)
    cluster = cluster.ravel()
    vertices = np.stack([np.bincount(cluster, scan.vertices[:, axis]) for axis in range(3)], 1) / count[:, None]
    faces = cluster[scan.faces]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(1)]
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    faces = _drop_fins(vertices, faces[np.sort(first)])
    # connected across edges: a piece joined by a corner is a floater
    label = trimesh.graph.connected_component_labels(trimesh.graph.face_adjacency(faces), len(faces))
    faces = faces[np.bincount(label)[label] >= LEAST_PART_SHARE * len(faces)]
    used, index = np.unique(faces, return_inverse=True)
    return Mesh(vertices[used], index.reshape(-1, 3))


def _drop_fins(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Drop triangles until no edge has more than two.

    Fins first, where sheets of the scan were pressed into one, then the smallest.
    """
    area = np.linalg.norm(
        np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]), axis=1
    )
    while True:
        _, edge, uses = np.unique(
            np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1),
            axis=0,
            return_inverse=True,
            return_counts=True,
        )
        uses_of_edges = uses[edge.ravel()].reshape(-1, 3)
        crowded = (uses_of_edges > 2).any(1)
        if not crowded.any():
            return faces
        order = np.lexsort((area, -(uses_of_edges == 1).sum(1)))
        order = order[crowded[order]]
        # drop one triangle per edge and round
        _, worst = np.unique(np.where(uses_of_edges > 2, edge.reshape(-1, 3), -1).max(1)[order], return_index=True)
        keep = np.ones(len(faces), bool)
        keep[order[worst]] = False
        faces, area = faces[keep], area[keep]


def project_colours(scan: Mesh, at: TexelPartners, views: list[View], tick: Callable[[float], None]) -> np.ndarray:
    """Return the colours that the views show, linear [S, S, 3], at the covered texels of the unwrapped scan.

    Zero where no view shows the scan; tick receives the share done.
    """
    size = len(at.covered)
    face, bary = raster.rasterize_uv(scan, size)
    points = raster.interpolate(scan.vertices, scan.faces, face[at.covered], bary[at.covered]).astype(np.float32)
    normals = raster.interpolate(vertex_normals(scan), scan.faces, face[at.covered], bary[at.covered])
    normals = normals.astype(np.float32)
    del face, bary
    normals = unit(normals)
    caster = raster.RayCaster(scan)
    total, weights = np.zeros((len(points), 3), np.float32), np.zeros(len(points), np.float32)
    for i, view in enumerate(views):
        tick(i / len(views))
        scale = min(1.0, 640 / max(view.width, view.height))
        _, _, depth = raster.render_view(caster, view, scale)
        towards = view.centre - points
        distance = np.linalg.norm(towards, axis=1)
        cosine = (towards * normals).sum(1) / distance
        facing = np.flatnonzero(cosine > 0.15)
        pixels, ahead = view.project(points[facing])
        inside = (ahead > 0) & (pixels > 1).all(1) & (pixels < [view.width - 1, view.height - 1]).all(1)
        facing, pixels = facing[inside], pixels[inside]
        cell = np.minimum((pixels * scale).astype(int), [depth.shape[1] - 1, depth.shape[0] - 1])
        unhidden = distance[facing] < depth[cell[:, 1], cell[:, 0]] + STEP_M / np.maximum(cosine[facing], 0.3)
        facing, pixels = facing[unhidden], pixels[unhidden]
        picture = images.read_linear(view.path)
        weight = (cosine[facing] ** COSINE_POWER).astype(np.float32)
        scale = [picture.shape[1] / view.width, picture.shape[0] / view.height]
        total[facing] += weight[:, None] * raster.sample(picture, pixels * scale)
        weights[facing] += weight
    colours = np.zeros((size, size, 3), np.float32)
    colours[at.covered] = total / np.maximum(weights, 1e-9)[:, None]
    return colours


def extend_albedo(albedo: np.ndarray, lit_map: np.ndarray, at: TexelPartners) -> np.ndarray:
    """Continue the albedo [S, S, 3] beyond the head's maps by the colours as filmed, scaled per channel to meet it."""
    filmed = lit_map.max(2) > 0
    both = at.known & filmed & (lit_map.min(2) > 0.01)
    if not both.any():
        return albedo
    gain = np.median(albedo[both], axis=0) / np.median(lit_map[both], axis=0)
    return np.where((~at.known & filmed)[..., None], np.clip(lit_map * gain, 0, 1), albedo)


def displacement(head: Mesh, scan: Mesh, size: int, tick: Callable[[float], None]) -> np.ndarray:
    """Return how far the scan lies outside the head along its normals, float32 [size, size] in metres.

    Zero where there is no scan; tick receives the share done.
    """
    surface, normals = surfaces.Surface(scan, 0.01), vertex_normals(head)
    out, covered = np.zeros((size, size), np.float32), np.zeros((size, size), bool)
    for row in range(0, size, STRIP_ROWS):
        tick(row / size)
        end = min(row + STRIP_ROWS, size)
        face, bary = raster.rasterize_uv(head, size, (row, end))
        inside = face >= 0
        points = raster.interpolate(head.vertices, head.faces, face[inside], bary[inside].astype(np.float64))
        n = unit(raster.interpolate(normals, head.faces, face[inside], bary[inside].astype(np.float64)))
        hit, _, distance = surface.cast_rays(points + FAR_M * n, -n, n)
        hit_near = (hit >= 0) & (distance < 2 * FAR_M)
        heights = np.where(hit_near, FAR_M - np.where(hit_near, distance, 0), 0)
        out[row:end][inside], covered[row:end][inside] = heights, hit_near
    return _fade(out, covered)


def _fade(displacement: np.ndarray, valid: np.ndarray) -> np.ndarray:
    inside = cv2.distanceTransform(np.pad(valid, 1, constant_values=True).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    return displacement * np.clip(inside / (FADE_PX * len(displacement) / 1024), 0, 1)


def unwrap(scan: Mesh, cell: float, size: int) -> Mesh:
    """Reduce and unwrap the scan; triangles that the atlas could not lay out are dropped."""
    mesh = atlas.unwrap(reduce(scan, cell), size)
    uvs = mesh.uvs[mesh.face_uvs]
    (ax, ay), (bx, by) = (uvs[:, 1] - uvs[:, 0]).T, (uvs[:, 2] - uvs[:, 0]).T
    laid_out = np.abs(ax * by - ay * bx) > 1e-14
    return replace(mesh, faces=mesh.faces[laid_out], face_uvs=mesh.face_uvs[laid_out])
