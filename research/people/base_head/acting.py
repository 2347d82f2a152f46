# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The built-in head cut open: lips and lids in two, with sockets and a mouth bag behind them, eyeballs, teeth and
tongue.

The head's vertices keep their numbers; what the cut doubles and what lies inside come after them. Everything is
MakeHuman's (see NOTICE.md) but the eyeballs, which are spheres with a cornea where its eyes are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse
import torch
from scipy.spatial import cKDTree

from .makehuman import PUPIL_DISTANCE_M, Base, HeadBuilder, catmull_clark, edge_numbers

SKIN, EYES, MOUTH, TEETH = range(4)
"""Material slots."""
SOFT, LEFT_EYE, RIGHT_EYE, JAWS = range(4)
"""What an inner vertex moves with when the head takes another shape: the rim before it, a ball, the jaws."""
SOCKET_RINGS = 3  # coarse rings of a socket that are kept: the rim of the lid and what goes round the ball
ANCHORS = 6  # vertices of a rim that carry an inner vertex
STRIP_M = 0.004  # UV: how far into the neighbouring skin a ring of the inner rim reaches for its colour


@dataclass(frozen=True)
class ActingHead:
    """V vertices of the head, C copies on the lower side of the seams, P inner ones; the order of every array with V +
    C + P rows."""

    copies: np.ndarray  # [C] the vertex that each copy doubles
    corners: np.ndarray  # [n, 3]: face of the head, corner, the copy it has now
    faces: np.ndarray  # [F, 4] of the inner parts, -1 for no fourth corner
    slots: np.ndarray  # [F] material slot of each
    uvs: np.ndarray  # [P, 2]
    kind: np.ndarray  # [P]
    anchors: np.ndarray  # [P, ANCHORS] vertices of the rims that carry it
    weights: np.ndarray  # [P, ANCHORS], sum 1
    rest: np.ndarray  # [V + C + P, 3] metres, lids and lips closed
    seam: np.ndarray  # [C] which of the copies are of the lips (0), the left lids (1), the right ones (2)
    ends: np.ndarray  # [3, 2] the vertices in which each seam ends
    matrix: sparse.csr_matrix  # [V + C + P, N] from a displacement of the body to one of this, both in MakeHuman's axes
    balls: np.ndarray  # [2, 4] centre and radius of the left and the right eyeball, metres

    def moved(self, offset: np.ndarray) -> np.ndarray:
        """A displacement of the body [N, 3], decimetres, as one of the open head [V + C + P, 3], decimetres, in our
        axes."""
        fine = self.matrix @ offset
        return np.stack([fine[:, 0], -fine[:, 2], fine[:, 1]], -1)


def open_head(base: Base, builder: HeadBuilder, body: np.ndarray, uvs: np.ndarray) -> ActingHead:
    """The open head of one body.

    Parameters
    ----------
    base : MakeHuman's body
    builder : of heads from it
    body : [N, 3], in decimetres, MakeHuman's axes
    uvs : [V, 2], the head's, any one of each vertex
    """
    polygons, inner, parent, extended = _split(base, builder)
    used = np.unique([i for p in polygons + inner for i in p])
    number = np.full(extended.shape[0], -1)
    number[used] = np.arange(len(used))
    fine, triangles = catmull_clark([[int(number[i]) for i in p] for p in polygons + inner], len(used))
    target = _targets(builder, polygons, inner, parent, used, number)
    welded = len(builder.mirror)
    lower = _lower(base, builder, parent).astype(float)
    order, copies = _order(target, fine @ lower[used], welded)
    matrix = fine @ extended[used]
    rows = np.argsort(order)
    matrix = matrix[rows]
    closed = builder._lips_closed(builder._lids_closed(body))
    triangles = order[triangles]
    outer = triangles[: len(builder.faces)]
    face, corner = np.nonzero(outer != builder.faces)
    eyes, teeth = _balls(base, body), _jaws(base)
    strips = triangles[len(builder.faces) :]
    placed = _placed(matrix @ closed, body, base)
    placed[:welded] = builder.head(body)
    placed[welded : welded + len(copies)] = placed[copies]
    kind, uv, anchors, weights, slots = _soft(placed, strips, copies, welded, uvs)
    start = len(placed)
    faces = [np.pad(strips, ((0, 0), (0, 1)), constant_values=-1)]
    kinds, uv_rows, slot_rows, places, matrices = [kind], [uv], [slots], [placed], [matrix]
    for vertices, quads, part_uv, part_kind, slot, part_matrix in (*eyes, *teeth):
        faces.append(np.where(quads >= 0, quads + start, -1))
        kinds.append(np.full(len(part_uv), part_kind))
        uv_rows.append(part_uv)
        slot_rows.append(np.full(len(quads), slot))
        places.append(_placed(part_matrix @ body if vertices is None else vertices, body, base))
        matrices.append(part_matrix)
        start += len(part_uv)
    rest = np.concatenate(places)
    kinds = np.concatenate(kinds)
    missing = len(kinds) - len(anchors)
    balls = [_ball(base, body, side) for side in "lr"]
    scale = _scale(base, body)
    balls = np.array([[*_placed(centre[None], body, base)[0], radius * scale] for centre, radius in balls])
    mouth = (builder._lips[0], *(upper for upper, _ in builder._lids.values()))
    ends = np.searchsorted(builder.used, [[chain[0], chain[-1]] for chain in mouth])
    return ActingHead(
        copies,
        np.stack([face, corner, outer[face, corner]], 1),
        np.concatenate(faces),
        np.concatenate(slot_rows),
        np.concatenate(uv_rows),
        kinds,
        np.pad(anchors, ((0, missing), (0, 0))),
        np.pad(weights, ((0, missing), (0, 0))),
        rest,
        _seam(rest, copies),
        ends,
        sparse.vstack(matrices).tocsr(),
        balls,
    )


def _order(target: np.ndarray, lower: np.ndarray, welded: int) -> tuple[np.ndarray, np.ndarray]:
    """The new number of each vertex [N], which is vertex `target` of the welded head, or none of it where that is
    negative; and which welded vertices have a second one, [C]. lower [N]: how much of it comes from the lower rim: of
    the two claimants of a seam's vertex, the lower one takes more."""
    order, copies, parts = np.empty(len(target), int), [], []
    claimants = [[] for _ in range(welded)]
    for i in np.flatnonzero(target >= 0):
        claimants[target[i]].append(i)
    for t, claim in enumerate(claimants):
        first, *second = sorted(claim, key=lambda i: lower[i])
        order[first] = t
        for i in second:
            order[i] = welded + len(copies)
            copies.append(t)
    for i in np.flatnonzero(target < 0):
        order[i] = welded + len(copies) + len(parts)
        parts.append(i)
    return order, np.array(copies)


def _split(base: Base, builder: HeadBuilder) -> tuple[list, list, np.ndarray, sparse.csr_matrix]:
    """Outer and inner polygons with both rims of each seam; which vertex of the welded head stands for each [N']; body
    -> vertices [N', N].

    The lower lip has fewer vertices than the upper one: it gets new ones, numbered after the body's.
    """
    upper, lower = builder._lips
    count = len(base.vertices)
    parent = np.concatenate([builder._representative, [i for i, j in zip(upper, lower, strict=True) if j is None]])
    partners = [k for k, i in enumerate(lower) if i is not None]
    rows, extra = [], {}
    for a, b in zip(partners, partners[1:], strict=False):
        between = []
        for k in range(a + 1, b):
            between.append(count + sum(i is None for i in lower[:k]))
            t = (k - a) / (b - a)
            rows += [(between[-1] - count, lower[a], 1 - t), (between[-1] - count, lower[b], t)]
        extra[lower[a], lower[b]], extra[lower[b], lower[a]] = between, between[::-1]
    r, c, v = zip(*rows, strict=True)
    extended = sparse.vstack(
        [sparse.identity(count), sparse.csr_matrix((v, (r, c)), shape=(len(parent) - count, count))]
    ).tocsr()

    def grown(polygon):
        return [
            i for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True) for i in (int(a), *extra.get((a, b), ()))
        ]

    cavities = torch.load(base.folder / "template_mesh_internal_cavities.pth", weights_only=True)
    inner = [base.faces[int(i)] for i in cavities["face_indices"]]
    near = {i for lids in builder._lids.values() for rim in lids for i in rim.tolist()}
    socket = [f for f in inner if base.vertices[list(f), 1].min() > 7.05]
    kept = [f for f in inner if base.vertices[list(f), 1].min() <= 7.05]
    for _ in range(SOCKET_RINGS):
        ring = [f for f in socket if near.intersection(f)]
        near |= {i for f in ring for i in f}
    kept += ring
    return [grown(p) for p in builder._open_polygons()], [grown(p) for p in kept], parent, extended


def _targets(
    builder: HeadBuilder, polygons: list, inner: list, parent: np.ndarray, used: np.ndarray, number: np.ndarray
) -> np.ndarray:
    """The vertex of the subdivided head that each vertex of the subdivided open head came from, -1 for inner ones."""
    coarse = np.full(len(parent), -1)
    coarse[builder.used] = np.arange(len(builder.used))
    welded = [[int(coarse[parent[i]]) for i in p] for p in polygons]
    edges = edge_numbers(welded)
    outer_edges = {(min(a, b), max(a, b)) for p in polygons for a, b in zip(p, p[1:] + p[:1], strict=True)}
    outer = {i for p in polygons for i in p}
    points = [coarse[parent[i]] if i in outer else -1 for i in used]
    middles = []
    back = {int(number[i]): int(i) for i in used}
    for a, b in edge_numbers([[int(number[i]) for i in p] for p in polygons + inner]):
        a, b = sorted((back[a], back[b]))
        pair = sorted((coarse[parent[a]], coarse[parent[b]]))
        middles.append(len(builder.used) + edges[tuple(pair)] if (a, b) in outer_edges else -1)
    centres = [len(builder.used) + len(edges) + k for k in range(len(polygons))] + [-1] * len(inner)
    return np.array(points + middles + centres)


def _lower(base: Base, builder: HeadBuilder, parent: np.ndarray) -> np.ndarray:
    """Whether a vertex lies on the lower rim of a seam, its corners left out [N']."""
    lower = np.zeros(len(parent), bool)
    for _, rim in builder._lids.values():
        lower[rim[1:-1]] = True
    lower[[i for i in builder._lips[1][1:-1] if i is not None]] = True
    lower[len(base.vertices) :] = True
    return lower


def _scale(base: Base, body: np.ndarray) -> float:
    left, right = (body[base.groups[f"joint-{side}-eye"]].mean(0) for side in "lr")
    return PUPIL_DISTANCE_M / np.linalg.norm(left - right)


def _placed(fine: np.ndarray, body: np.ndarray, base: Base) -> np.ndarray:
    """MakeHuman's decimetres -> metres with the pupils' middle at the origin, as HeadBuilder.head does."""
    middle = np.mean([body[base.groups[f"joint-{side}-eye"]].mean(0) for side in "lr"], 0)
    fine = (fine - middle) * _scale(base, body)
    return np.stack([fine[:, 0], -fine[:, 2], fine[:, 1]], -1)


def _soft(placed: np.ndarray, strips: np.ndarray, copies: np.ndarray, welded: int, uvs: np.ndarray) -> tuple:
    """Kind, UV, anchors and weights of the sockets' and the bag's vertices, and the slot of their faces."""
    first = welded + len(copies)
    inner = np.arange(first, len(placed))
    ring = np.full(len(placed), 99)
    rim = np.setdiff1d(np.unique(strips), inner)
    ring[rim] = 0
    root = np.full(len(placed), -1)
    root[rim] = rim
    for _ in range(40):  # breadth first from the rims: how many edges inside, and from which rim vertex
        for a, b in ((0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)):
            better = ring[strips[:, a]] + 1 < ring[strips[:, b]]
            ring[strips[better, b]] = ring[strips[better, a]] + 1
            root[strips[better, b]] = root[strips[better, a]]
    source = np.concatenate([np.arange(welded), copies])
    side = np.where(root[inner] >= welded, -1.0, 1.0)
    uv = uvs[source[root[inner]]] + np.stack([0 * side, side * STRIP_M * np.minimum(ring[inner], 6)], 1)
    distance, nearest = cKDTree(placed[rim]).query(placed[inner], ANCHORS)
    weights = 1 / (distance**2 + 1e-8)
    depth = ring[strips].min(1)
    eye = placed[strips].mean(1)[:, 2] > -0.02
    slots = np.where(eye | (depth < 3), SKIN, MOUTH)
    return np.full(len(inner), SOFT), uv, source[rim[nearest]], weights / weights.sum(1, keepdims=True), slots


def _ball(base: Base, body: np.ndarray, side: str) -> tuple[np.ndarray, float]:
    """Centre [3] and radius of an eye, decimetres: half as wide as MakeHuman's eye, which is a sphere but for its
    cornea, and touching its back."""
    points = body[base.groups[f"helper-{side}-eye"]]
    low, high = points.min(0), points.max(0)
    radius = (high[0] - low[0]) / 2
    return np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2] + radius]), float(radius)


def _balls(base: Base, body: np.ndarray) -> list[tuple]:
    """Both eyeballs: rings around the gaze; UV grows with the angle from the pupil, so that iris and white are rings of
    a picture."""
    around, along = 32, 20
    angle = np.concatenate([np.linspace(0, 0.62, 10), np.linspace(0.62, np.pi, along - 9)[1:]])  # finer on the cornea
    # the cornea's summit stands 0.7 mm before the white's sphere
    bulge = 1 + 0.06 * np.clip(1 - (angle / 0.52) ** 2, 0, None)
    turn = np.arange(around) * 2 * np.pi / around
    ring = np.sin(angle)[1:-1, None] * bulge[1:-1, None]
    body_of = np.stack(
        [ring * np.cos(turn), ring * np.sin(turn), (np.cos(angle) * bulge)[1:-1, None] * np.ones(around)], -1
    ).reshape(-1, 3)
    unit = np.concatenate([[[0, 0, bulge[0]]], body_of, [[0, 0, -1]]])
    # the iris gets the most of the picture
    radius = 0.5 * (np.concatenate([[0], np.repeat(angle[1:-1], around), [np.pi]]) / np.pi) ** 0.6
    turns = np.concatenate([[0], np.tile(turn, len(angle) - 2), [0]])
    uv = 0.5 + np.stack([radius * np.cos(turns), radius * np.sin(turns)], 1)
    rows = len(angle) - 2
    k = np.arange(around)
    n = (k + 1) % around
    faces = [np.stack([0 * k, 1 + k, 1 + n, np.full(around, -1)], 1)]
    for r in range(rows - 1):
        a, b = 1 + r * around, 1 + (r + 1) * around
        faces.append(np.stack([a + k, b + k, b + n, a + n], 1))
    faces.append(
        np.stack(
            [
                1 + (rows - 1) * around + n,
                1 + (rows - 1) * around + k,
                np.full(around, len(unit) - 1),
                np.full(around, -1),
            ],
            1,
        )
    )
    faces = np.concatenate(faces)
    result = []
    for side, kind in (("l", LEFT_EYE), ("r", RIGHT_EYE)):
        centre, r = _ball(base, body, side)
        result.append((unit * r + centre, faces, uv, kind, EYES, sparse.csr_matrix((len(unit), len(base.vertices)))))
    return result


def _jaws(base: Base) -> list[tuple]:
    """Teeth and tongue, MakeHuman's helpers as they are."""
    result = []
    for group, slot in (("helper-upper-teeth", TEETH), ("helper-lower-teeth", TEETH), ("helper-tongue", MOUTH)):
        members = base.groups[group]
        number = np.full(len(base.vertices), -1)
        number[members] = np.arange(len(members))
        faces = np.array([[number[i] for i in f] + [-1] * (4 - len(f)) for f in base.helper_faces(group)])
        matrix = sparse.csr_matrix(
            (np.ones(len(members)), (np.arange(len(members)), members)), shape=(len(members), len(base.vertices))
        )
        result.append((None, faces, np.full((len(members), 2), 0.5), JAWS, slot, matrix))
    return result


def _seam(vertices: np.ndarray, copies: np.ndarray) -> np.ndarray:
    at = vertices[copies]
    return np.where(at[:, 2] < -0.02, 0, np.where(at[:, 0] > 0, 1, 2))
