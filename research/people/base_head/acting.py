# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The built-in head cut open: lips and lids in two, sockets and a mouth bag, eyeballs, teeth and tongue.

The head's vertices keep their numbers; what the cut doubles and what lies inside come after them. Everything is
MakeHuman's (see NOTICE.md) but the eyeballs, which are spheres with a cornea where its eyes are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse
import torch
from scipy.spatial import cKDTree

from .makehuman import Base, HeadBuilder, catmull_clark, edge_numbers, sides, to_our_axes

SKIN, EYES, MOUTH, TEETH = range(4)
"""Material slots."""
SOFT, LEFT_EYE, RIGHT_EYE, JAWS = range(4)
"""What an inner vertex moves with when the head takes another shape: the rim before it, a ball, the jaws."""
SOCKET_RINGS = 3  # coarse rings of a socket that are kept: the rim of the lid and what goes round the ball
ANCHORS = 6  # vertices of a rim that carry an inner vertex
STRIP_M = 0.004  # UV: how far into the neighbouring skin a ring of the inner rim reaches for its colour


@dataclass(frozen=True)
class ActingHead:
    """V vertices of the head, C copies on the lower side of the seams, P inner ones, in this order."""

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
        """Return a body displacement [N, 3] as one of the open head [V + C + P, 3] in our axes, both in decimetres."""
        return to_our_axes(self.matrix @ offset)


@dataclass(frozen=True)
class _Part:
    """Vertices [N, 3] in metres, their faces [F, 4], UVs [N, 2], kinds [N], slots [F] and the matrix from a body."""

    vertices: np.ndarray
    faces: np.ndarray
    uvs: np.ndarray
    kind: np.ndarray
    slots: np.ndarray
    matrix: sparse.csr_matrix


def open_head(base: Base, builder: HeadBuilder, body: np.ndarray, uvs: np.ndarray) -> ActingHead:
    """Open the head of a body [N, 3] in decimetres, MakeHuman's axes.

    uvs [V, 2]: the head's, any one of each vertex.
    """
    polygons, inner, parent, extended = _split(base, builder)
    used = np.unique([i for p in polygons + inner for i in p])
    number = np.full(extended.shape[0], -1)
    number[used] = np.arange(len(used))
    fine, triangles = catmull_clark([[int(number[i]) for i in p] for p in polygons + inner], len(used))
    welded = len(builder.mirror)
    target = _targets(builder, polygons, inner, parent, used, number)
    order, copies = _order(target, fine @ _lower(base, builder, parent)[used].astype(float), welded)
    outer, strips = np.split(order[triangles], [len(builder.faces)])
    face, corner = np.nonzero(outer != builder.faces)
    matrix = (fine @ extended[used])[np.argsort(order)]
    placed = base.place(matrix @ builder.closed(body), body)
    placed[:welded] = builder.head(body)
    placed[welded : welded + len(copies)] = placed[copies]
    kind, uv, anchors, weights, slots = _soft(placed, strips, copies, welded, uvs)
    strips = np.pad(strips, ((0, 0), (0, 1)), constant_values=-1)
    parts = [_Part(placed, strips, uv, kind, slots, matrix), *_balls(base, body), *_jaws(base, body)]
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    kind, rest = (np.concatenate([getattr(part, name) for part in parts]) for name in ("kind", "vertices"))
    missing = len(kind) - len(anchors)
    middles = [_ball(base, body, side) for side in "lr"]
    balls = [[*base.place(centre[None], body)[0], radius * base.scale(body)] for centre, radius in middles]
    rims = (builder.lips[0], *(upper for upper, _ in builder.lids.values()))
    at = rest[copies]
    return ActingHead(
        copies,
        np.stack([face, corner, outer[face, corner]], 1),
        np.concatenate([np.where(p.faces >= 0, p.faces + start, -1) for p, start in zip(parts, starts, strict=True)]),
        np.concatenate([part.slots for part in parts]),
        np.concatenate([part.uvs for part in parts]),
        kind,
        np.pad(anchors, ((0, missing), (0, 0))),
        np.pad(weights, ((0, missing), (0, 0))),
        rest,
        np.where(at[:, 2] < -0.02, 0, np.where(at[:, 0] > 0, 1, 2)),
        np.searchsorted(builder.used, [[rim[0], rim[-1]] for rim in rims]),
        sparse.vstack([part.matrix for part in parts]).tocsr(),
        np.array(balls),
    )


def _order(target: np.ndarray, lower: np.ndarray, welded: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the new number of each vertex [N] and the welded vertices that have a second one, [C].

    target [N]: the vertex of the welded head, negative for none; lower [N]: share that comes from the lower rim: of the
    two claimants of a seam's vertex, the lower one takes more.
    """
    order, outer = np.empty(len(target), int), np.flatnonzero(target >= 0)
    outer = outer[np.lexsort((lower[outer], target[outer]))]
    second = np.diff(target[outer], prepend=-1) == 0
    copies = target[outer[second]]
    order[outer[~second]] = target[outer[~second]]
    inner = np.flatnonzero(target < 0)
    order[np.concatenate([outer[second], inner])] = welded + np.arange(len(copies) + len(inner))
    return order, copies


def _split(base: Base, builder: HeadBuilder) -> tuple[list, list, np.ndarray, sparse.csr_matrix]:
    """Cut the seams open: outer and inner polygons, welded vertex of each vertex [N'], body -> vertices [N', N].

    The lower lip has fewer vertices than the upper one: it gets new ones, numbered after the body's.
    """
    upper, lower = builder.lips
    count = len(base.vertices)
    parent = np.concatenate([builder.representative, [i for i, j in zip(upper, lower, strict=True) if j is None]])
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
        return [i for a, b in sides(polygon) for i in (int(a), *extra.get((a, b), ()))]

    cavities = torch.load(base.folder / "template_mesh_internal_cavities.pth", weights_only=True)
    inner = [base.faces["body"][int(i)] for i in cavities["face_indices"]]
    near = {i for lids in builder.lids.values() for rim in lids for i in rim.tolist()}
    socket = [f for f in inner if base.vertices[list(f), 1].min() > 7.05]
    lining = [f for f in inner if base.vertices[list(f), 1].min() <= 7.05]
    for _ in range(SOCKET_RINGS):
        ring = [f for f in socket if near.intersection(f)]
        near |= {i for f in ring for i in f}
    lining += ring
    return [grown(p) for p in builder.open_polygons()], [grown(p) for p in lining], parent, extended


def _targets(
    builder: HeadBuilder, polygons: list, inner: list, parent: np.ndarray, used: np.ndarray, number: np.ndarray
) -> np.ndarray:
    """Return the subdivided head's vertex that each of the subdivided open head came from, -1 for inner ones."""
    coarse = np.full(len(parent), -1)
    coarse[builder.used] = np.arange(len(builder.used))
    welded = [[int(coarse[parent[i]]) for i in p] for p in polygons]
    edges = edge_numbers(welded)
    outer_edges = {(min(a, b), max(a, b)) for p in polygons for a, b in sides(p)}
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
    """Mark the vertices on the lower rim of a seam, its corners left out [N']."""
    lower = np.zeros(len(parent), bool)
    for _, rim in builder.lids.values():
        lower[rim[1:-1]] = True
    lower[[i for i in builder.lips[1][1:-1] if i is not None]] = True
    lower[len(base.vertices) :] = True
    return lower


def _soft(placed: np.ndarray, strips: np.ndarray, copies: np.ndarray, welded: int, uvs: np.ndarray) -> tuple:
    """Return kind, UV, anchors and weights of the sockets' and the bag's vertices, and the slot of their faces."""
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
    """Return centre [3] and radius of an eye, decimetres.

    Half as wide as MakeHuman's eye, which is a sphere but for its cornea, and touching its back.
    """
    points = body[base.groups[f"helper-{side}-eye"]]
    low, high = points.min(0), points.max(0)
    radius = (high[0] - low[0]) / 2
    return np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2] + radius]), float(radius)


def _balls(base: Base, body: np.ndarray) -> list[_Part]:
    """Return both eyeballs: rings around the gaze.

    UV grows with the angle from the pupil, so that iris and white are rings of a picture.
    """
    around = 32
    angle = np.concatenate([np.linspace(0, 0.62, 10), np.linspace(0.62, np.pi, 11)[1:]])  # finer on the cornea
    # the cornea's summit stands 0.7 mm before the white's sphere
    bulge = 1 + 0.06 * np.clip(1 - (angle / 0.52) ** 2, 0, None)
    turn = np.arange(around) * 2 * np.pi / around
    ring = np.sin(angle)[1:-1, None] * bulge[1:-1, None]
    ahead = (np.cos(angle) * bulge)[1:-1, None] * np.ones(around)
    rings = np.stack([ring * np.cos(turn), ring * np.sin(turn), ahead], -1).reshape(-1, 3)
    sphere = np.concatenate([[[0, 0, bulge[0]]], rings, [[0, 0, -1]]])
    # the iris gets the most of the picture
    radius = 0.5 * (np.concatenate([[0], np.repeat(angle[1:-1], around), [np.pi]]) / np.pi) ** 0.6
    turns = np.concatenate([[0], np.tile(turn, len(angle) - 2), [0]])
    uv = 0.5 + np.stack([radius * np.cos(turns), radius * np.sin(turns)], 1)
    k = np.arange(around)
    n, none, last = (k + 1) % around, np.full(around, -1), len(sphere) - 1 - around
    faces = [np.stack([0 * k, 1 + k, 1 + n, none], 1)]
    faces += [np.stack([a + k, a + around + k, a + around + n, a + n], 1) for a in range(1, last, around)]
    faces = np.concatenate([*faces, np.stack([last + n, last + k, none + len(sphere), none], 1)])
    parts = []
    for side, kind in (("l", LEFT_EYE), ("r", RIGHT_EYE)):
        centre, size = _ball(base, body, side)
        still = sparse.csr_matrix((len(sphere), len(base.vertices)))
        kinds, slots = np.full(len(sphere), kind), np.full(len(faces), EYES)
        parts.append(_Part(base.place(sphere * size + centre, body), faces, uv, kinds, slots, still))
    return parts


def _jaws(base: Base, body: np.ndarray) -> list[_Part]:
    """Return teeth and tongue, MakeHuman's helpers as they are."""
    parts = []
    for group, slot in (("helper-upper-teeth", TEETH), ("helper-lower-teeth", TEETH), ("helper-tongue", MOUTH)):
        members = base.groups[group]
        count, number = len(members), np.full(len(base.vertices), -1)
        number[members] = np.arange(count)
        faces = np.array([[number[i] for i in f] + [-1] * (4 - len(f)) for f in base.faces[group]])
        matrix = sparse.csr_matrix((np.ones(count), (np.arange(count), members)), shape=(count, len(base.vertices)))
        vertices, uv = base.place(matrix @ body, body), np.full((count, 2), 0.5)
        parts.append(_Part(vertices, faces, uv, np.full(count, JAWS), np.full(len(faces), slot), matrix))
    return parts
