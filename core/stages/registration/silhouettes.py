# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Outline of the face in each picture, where skin meets the background, against that of a mesh.

Only what borders on the background counts: hair over a cheek, or a jaw before a neck, is no outline of the face. The
border is found by colours, for the person's mask is too coarse: each picture's own skin against its own background.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from ...face import faces
from ...geometry.meshes import Mesh, unit, vertex_normals
from ...geometry.views import View
from ...imaging import images
from .constraints import Constraints, none

HISTOGRAM_BINS = 12  # bins of the colour histograms, per channel
LEAST_CERTAINTY_STEP = 0.5  # minimum difference in certainty of skin between the inside and the outside
COARSE_PX = 5.0
"""Uncertainty of the person's mask in a picture of 960 pixels: a border of colours further from it is another one."""
RIM_PX = 3.0  # maximum distance of a vertex inside the mesh's outline, in pixels: triangles are that coarse


@dataclass(frozen=True)
class Outline:
    """Picture prepared at `scale` times its size: certainties in [0, 1] of skin [H, W] and person [H, W]."""

    view: View
    skin: np.ndarray
    person: np.ndarray
    scale: float


def prepare(view: View, mesh: Mesh, follow: np.ndarray, scale: float = 1.0) -> Outline:
    """Find skin and person in a view's picture; skin looks like the pixels that the followed part of the mesh covers.

    follow [V] above 0.5 is that part of a mesh that lies about right, in metres.
    """
    picture = view.read()
    height, width = round(view.height * scale), round(view.width * scale)
    picture = images.resize(picture, width, height) if (height, width) != picture.shape[:2] else picture
    person = faces.segment_person(picture)
    pixels, _ = view.project(mesh.vertices[follow > 0.5])
    inside = np.zeros((height, width), np.uint8)
    hull = cv2.convexHull(np.round(pixels[np.isfinite(pixels).all(1)] * scale).astype(np.int32))
    cv2.fillConvexPoly(inside, hull, 1)
    core = cv2.erode(inside, np.ones((1 + 2 * max(1, round(0.01 * width)),) * 2, np.uint8)) > 0
    around = cv2.dilate(inside, np.ones((1 + 2 * round(0.08 * width),) * 2, np.uint8)) > 0
    lab = cv2.cvtColor(picture.astype(np.float32), cv2.COLOR_RGB2Lab)
    bins = np.clip((lab - [0, -40, -40]) / [100, 80, 80] * HISTOGRAM_BINS, 0, HISTOGRAM_BINS - 1).astype(int)
    code = (bins[..., 0] * HISTOGRAM_BINS + bins[..., 1]) * HISTOGRAM_BINS + bins[..., 2]
    skin, other = (_histogram(code[where]) for where in (core & (person > 0.8), around & (person < 0.2)))
    return Outline(view, (skin / (skin + other + 1e-6))[code].astype(np.float32), person, scale)


def compare(outline: Outline, mesh: Mesh, edges: np.ndarray, follow: np.ndarray, reach_m: float) -> Constraints:
    """Constrain the vertices of the mesh's outline in a view to the border of skin and background.

    edges are `edges_of` the mesh, follow [V] in [0, 1] weighs the vertices, and the border is searched within reach_m
    metres.
    """
    view, scale = outline.view, outline.scale
    pixels, depth = view.project(mesh.vertices)
    normals = vertex_normals(mesh)
    vertices = _on_outline(outline, mesh, edges, np.nan_to_num(pixels * scale, nan=-1e4))
    vertices = vertices[(follow[vertices] > 0.3) & np.isfinite(pixels[vertices]).all(1)]
    if not len(vertices):
        return none()
    towards = unit(view.centre - mesh.vertices[vertices])
    direction = unit(normals[vertices] - (normals[vertices] * towards).sum(1, keepdims=True) * towards)
    outward = view.project(mesh.vertices[vertices] + 1e-3 * direction)[0] - pixels[vertices]
    length = np.linalg.norm(outward, axis=1, keepdims=True)
    per_px = 1e-3 / np.maximum(length[:, 0], 1e-9) / scale  # metres
    reach = reach_m / float(np.median(per_px))
    away, step = _borders(outline, pixels[vertices] * scale, outward / np.maximum(length, 1e-9), reach)
    good = np.isfinite(away) & (np.abs(away) * per_px < reach_m)
    corners = np.repeat(vertices[good, None], 3, 1)
    return Constraints(
        corners,
        np.tile([1.0, 0.0, 0.0], (good.sum(), 1)),
        direction[good],
        (away * per_px)[good],
        (follow[vertices] * step)[good],
    )


def edges_of(mesh: Mesh) -> np.ndarray:
    """Return the edges between two triangles: int64 [E, 4], their vertices and triangles."""
    ends = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    face = np.repeat(np.arange(len(mesh.faces)), 3)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    ends, face = ends[order], face[order]
    twin = np.flatnonzero((ends[1:] == ends[:-1]).all(1))
    return np.concatenate([ends[twin], face[twin, None], face[twin + 1, None]], 1)


def _on_outline(outline: Outline, mesh: Mesh, edges: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """Return vertices [N] on the outline of the mesh, with no other part of it behind; pixels is [V, 2]."""
    a, b, c = (pixels[mesh.faces[:, i]] for i in range(3))
    # counter-clockwise, and rows go down
    front = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0]) < 0
    covered = np.zeros(outline.skin.shape, np.uint8)
    for triangle in np.round(np.stack([a, b, c], 1)[front] * 16 - 8).astype(np.int32):
        cv2.fillConvexPoly(covered, triangle, 1, cv2.LINE_8, 4)
    inside = cv2.distanceTransform(covered, cv2.DIST_L2, 3)
    vertices = np.unique(edges[front[edges[:, 2]] != front[edges[:, 3]], :2])
    x, y = np.clip(np.floor(pixels[vertices]).astype(int), 0, np.array(covered.shape[::-1]) - 1).T
    return vertices[inside[y, x] <= RIM_PX]


def _borders(outline: Outline, at: np.ndarray, outward: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Return how far along `outward` [N, 2] from pixels `at` [N, 2] skin gives way to background, and how clearly.

    nan where it does not; the clarity [N] is in [0, 1].
    """
    width = 4
    steps = np.arange(-np.ceil(reach) - width, np.ceil(reach) + width + 1)
    where = at[:, None] - 0.5 + outward[:, None] * steps[:, None]
    skin, person = (
        cv2.remap(
            image,
            where[..., 0].astype(np.float32),
            where[..., 1].astype(np.float32),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
        for image in (outline.skin, outline.person)
    )
    total = np.cumsum(np.pad(skin, ((0, 0), (1, 0))), 1)
    inside = (total[:, width:-width] - total[:, : -2 * width]) / width
    outside = (total[:, 2 * width :] - total[:, width:-width]) / width
    change, places = inside - outside, steps[width:] - 0.5  # a border lies between two samples
    places = places[: change.shape[1]]
    beyond = int(np.ceil(COARSE_PX * outline.scale))
    index = np.arange(change.shape[1]) + width
    out = person[:, np.minimum(index + beyond, len(steps) - 1)] < 0.5
    into = person[:, np.maximum(index - beyond, 0)] > 0.5
    change = np.where(out & into, change, -1)
    best = change.argmax(1)
    step = change[np.arange(len(at)), best]
    inside_frame = ((where >= 1) & (where <= np.array(outline.skin.shape[::-1]) - 2)).all((1, 2))
    return np.where((step > LEAST_CERTAINTY_STEP) & inside_frame, places[best], np.nan), np.clip(step, 0, 1)


def _histogram(code: np.ndarray) -> np.ndarray:
    """Return smoothed shares [HISTOGRAM_BINS**3] of the colours with these codes."""
    counts = np.bincount(code, minlength=HISTOGRAM_BINS**3).astype(np.float64).reshape((HISTOGRAM_BINS,) * 3)
    for axis in range(3):
        counts = counts + 0.5 * (np.roll(counts, 1, axis) + np.roll(counts, -1, axis))
    return (counts / max(counts.sum(), 1.0)).ravel()
