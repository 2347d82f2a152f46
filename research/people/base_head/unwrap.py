# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The unwrap of a disc (head cut open along the back) onto the unit square, at a wanted scale, without overlap.

It starts from a mean-value embedding, which is free of overlap (Floater 2003), and minimises the symmetric Dirichlet
energy (Smith and Schaefer 2015) by scalable locally injective mappings (Rabinovich et al. 2017); steps never pass the
first flip.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu


def unwrap(
    vertices: np.ndarray, faces: np.ndarray, mirror: np.ndarray, scale: np.ndarray, steps: int = 60
) -> tuple[np.ndarray, np.ndarray]:
    """Lay the head out: UVs [T, 2] in [0, 1], u = 0.5 the middle, and face_uvs [F, 3].

    vertices [V, 3] in metres, left and right alike; mirror [V]: the mirrored vertex of each; scale [F]: wanted UV
    length per metre; steps of the minimisation at most.
    """
    cut_faces, origin, twin, seam_left, seam_right, ring = _cut_open(vertices, faces, mirror)
    points = vertices[origin]
    fixed, start = _boundary(points, seam_left, seam_right, ring)
    rest = _rest_shapes(points[cut_faces]) * scale[:, None, None]
    uv = _mean_value_embedding(points, cut_faces, start)
    uv = _symmetric(uv, twin)
    uv = _minimise(uv, cut_faces, rest, fixed, twin, steps)
    a, b = uv[cut_faces[:, 1]] - uv[cut_faces[:, 0]], uv[cut_faces[:, 2]] - uv[cut_faces[:, 0]]
    assert (a[:, 0] * b[:, 1] > a[:, 1] * b[:, 0]).all(), "the unwrap overlaps"
    return uv, cut_faces


def _cut_open(vertices, faces, mirror):
    """Double the mid-line vertices of the back of the head up to its crown; the left side (+X) keeps the old ones."""
    edges = {(int(a), int(b)) for f in faces for a, b in zip(f, np.roll(f, -1), strict=True)}
    rim = {a: b for a, b in edges if (b, a) not in edges}
    middle = mirror == np.arange(len(vertices))
    along = {}
    for a, b in edges:
        if middle[a] and middle[b]:
            along.setdefault(a, set()).add(b)
            along.setdefault(b, set()).add(a)
    seam = [max((a for a in rim if middle[a]), key=lambda a: vertices[a, 1])]
    while vertices[seam[-1], 1] > 0.05 or vertices[seam[-1], 2] < 0:
        ahead = [b for b in along[seam[-1]] if b not in seam]
        seam.append(max(ahead, key=lambda b: vertices[b, 2]))
    doubled = {v: len(vertices) + k for k, v in enumerate(seam[:-1])}
    right = vertices[faces][..., 0].mean(1) < 0
    cut = np.array([[doubled.get(int(v), v) if r else v for v in f] for f, r in zip(faces, right, strict=True)])
    origin = np.concatenate([np.arange(len(vertices)), seam[:-1]])
    twin = np.concatenate([mirror, seam[:-1]])
    for v, copy in doubled.items():
        twin[v] = copy
    ring, here = [], seam[0]
    while True:
        here = rim[here]
        if here == seam[0]:
            break
        ring.append(here)
    if vertices[ring[0], 0] > 0:
        ring = ring[::-1]  # from the right side of the back (-X) round the front to the left
    return cut, origin, twin, seam, [doubled.get(v, v) for v in seam], ring


def _boundary(points, seam_left, seam_right, ring):
    """Return the fixed coordinates, bool [T, 2], and the boundary's start.

    Neck below, seam on the sides and from both sides along the top.
    """
    fixed, start = np.zeros((len(points), 2), bool), np.full((len(points), 2), np.nan)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points[seam_left], axis=0), axis=1))])
    length /= length[-1]
    corner = int(np.argmin(np.abs(length - 0.62)))
    for seam, u in ((seam_left, 1.0), (seam_right, 0.0)):
        for k, v in enumerate(seam):
            if k <= corner:
                start[v] = u, length[k] / length[corner]
                fixed[v] = True, k in (0, corner)
            else:
                t = (length[k] - length[corner]) / (1 - length[corner])
                start[v] = u + (0.5 - u) * t, 1
                fixed[v] = k == len(seam) - 1, True
    path = points[[seam_right[0], *ring, seam_left[0]]]
    t = np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))
    start[ring] = np.stack([t[:-1] / t[-1], np.zeros(len(ring))], 1)
    fixed[ring, 1] = True
    return fixed, start


def _mean_value_embedding(points, faces, start):
    pinned = ~np.isnan(start[:, 0])
    rows, columns, edge_weights = [], [], []
    for k in range(3):
        i, j, o = faces[:, k], faces[:, (k + 1) % 3], faces[:, (k + 2) % 3]
        a, b = points[j] - points[i], points[o] - points[i]
        la, lb = np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)
        half = np.tan(np.arccos(np.clip((a * b).sum(1) / (la * lb), -1, 1)) / 2)
        rows += [i, i]
        columns += [j, o]
        edge_weights += [half / la, half / lb]
    weights = sparse.csr_matrix(
        (np.concatenate(edge_weights), (np.concatenate(rows), np.concatenate(columns))), shape=(len(points),) * 2
    )
    laplacian = sparse.diags(np.asarray(weights.sum(1)).ravel()) - weights
    uv = np.where(pinned[:, None], start, 0)
    solver = splu(laplacian[~pinned][:, ~pinned].tocsc())
    uv[~pinned] = solver.solve(np.asarray(-laplacian[~pinned][:, pinned] @ start[pinned]))
    return uv


def _rest_shapes(corners):
    """Return two edge vectors of each triangle in its own plane: [F, 2, 2], edges as columns."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    la = np.linalg.norm(a, axis=1)
    x = (a * b).sum(1) / la
    y = np.linalg.norm(np.cross(a, b), axis=1) / la
    shape = np.stack([np.stack([la, x], -1), np.stack([np.zeros_like(la), y], -1)], 1)
    equilateral = np.array([[1, 0.5], [0, np.sqrt(0.75)]])
    u, sigma, vt = np.linalg.svd(shape @ np.linalg.inv(equilateral))
    # a sliver may open up: nothing else would gain from keeping it thin
    sigma[:, 1] = np.maximum(sigma[:, 1], sigma[:, 0] / 5)
    return (u * sigma[:, None]) @ vt @ equilateral


def _minimise(uv, faces, flat_triangles, fixed, twin, steps):
    """Minimise by SLIM.

    The energy's quadratic proxy at the present map (weights in closed form from its singular values) is solved, then a
    line search.
    """
    inverse, area = np.linalg.inv(flat_triangles), np.linalg.det(flat_triangles) / 2
    # [F, 3, 2] gradients of the corners' hat functions
    hats = np.stack([-inverse.sum(1), inverse[:, 0], inverse[:, 1]], 1)
    products = np.einsum("fkb,flb->fkl", hats, hats) * area[:, None, None]
    dof = 2 * faces[:, :, None] + np.arange(2)  # [F, 3, 2]
    dof = dof.reshape(-1, 6)
    rows, columns = np.repeat(dof, 6, 1).ravel(), np.tile(dof, (1, 6)).ravel()
    free = np.flatnonzero(~fixed.ravel())
    value = _energy(uv, faces, inverse, area)
    for step in range(1, steps + 1):  # noqa: B007  (its last value is printed)
        jacobian = np.einsum("fka,fkb->fab", uv[faces], hats)
        u, sigma, vt = np.linalg.svd(jacobian)
        weight = (sigma + 1) * (sigma**2 + 1) / sigma**3
        metric = np.einsum("fai,fi,fci->fac", u, weight, u)
        pull = np.einsum("fkb,fab->fka", hats, metric @ u @ vt) * area[:, None, None]
        stiffness = np.einsum("fkl,fac->fkalc", products, metric)
        matrix = sparse.csr_matrix((stiffness.ravel(), (rows, columns)), shape=(2 * len(uv),) * 2)
        force = np.zeros(2 * len(uv))
        np.add.at(force, dof, pull.reshape(-1, 6))
        direction = np.zeros(2 * len(uv))
        direction[free] = splu(matrix[free][:, free].tocsc()).solve((force - matrix @ uv.ravel())[free])
        direction = _symmetric(direction.reshape(-1, 2), twin, offset=0.0)
        length = min(1.0, 0.8 * _first_flip(uv, direction, faces))
        while (new_value := _energy(uv + length * direction, faces, inverse, area)) > value and length > 1e-9:
            length /= 2
        done = value - new_value < 1e-5 * value
        uv, value = uv + length * direction, min(new_value, value)
        if done:
            break
    print(f"unwrap: energy {value / area.sum():.3f} per unit area (4 is an isometry) after {step} steps")
    return uv


def _energy(uv, faces, inverse, area):
    p = uv[faces]
    jacobian = np.stack([p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]], -1) @ inverse
    return float((area * (jacobian**2).sum((1, 2)) * (1 + np.linalg.det(jacobian) ** -2)).sum())


def _first_flip(uv, direction, faces):
    """Return the largest step before a triangle's area reaches zero."""
    p, d = uv[faces], direction[faces]
    a, b, c, e = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0], d[:, 1] - d[:, 0], d[:, 2] - d[:, 0]

    def cross(m, n):
        return m[:, 0] * n[:, 1] - m[:, 1] * n[:, 0]

    q2, q1, q0 = cross(c, e), cross(a, e) + cross(c, b), cross(a, b)
    root = np.sqrt(np.maximum(q1**2 - 4 * q2 * q0, 0))
    with np.errstate(divide="ignore", invalid="ignore"):
        roots = np.stack([2 * q0 / (-q1 + root), 2 * q0 / (-q1 - root)])
    roots = np.where((q1**2 - 4 * q2 * q0 >= 0) & (roots > 0), roots, np.inf)
    return float(np.nanmin(roots))


def _symmetric(uv, twin, offset: float = 1.0):
    """Average with the mirror image about u = 0.5 (offset 1) or, for directions, about 0 (offset 0)."""
    other = uv[twin] * [-1, 1] + [offset, 0]
    return (uv + other) / 2
