# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The last millimetres: a smooth displacement of every vertex onto the scan, stiff to soft.

Minimises data + thin-plate bending of the displacement by sparse least squares, as optimal-step non-rigid ICP does
(Amberg, Romdhani, Vetter 2007). A vertex is drawn to its scan patch along the patch's normal only, so the mesh
slides along the surface; where there is no data (ears, scalp, neck, holes) stiffness stays high and the shape follows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from ...geometry.meshes import Mesh, vertex_normals
from .alignment import HeadModel
from .correspondence import Scan, trimmed
from .intersections import flipped

STIFF_M, SOFT_M = 0.030, 0.0022
"""Length over which the displacement is held together, at the first and the last step, metres."""
BLIND_M = 0.020
"""The same where the scan is not followed; it never softens below this."""
FAR_M, NEAR_M = 0.030, 0.002
"""Distance beyond which a scan patch is no partner: at the first and the last step."""
PULL, BLIND_PULL = 1e-3, 2e-2
"""Weight of staying where the identity fit is, against data of weight one; and where the scan is not followed, lest the
crown overshoot."""
LANDMARK_AREA_M2 = (3e-4, 3e-6)
"""Surface area that one landmark counts for, at the first and the last step."""

PUT_AREA_M2 = 1e-3
"""The same for one that the artist has put, from the first step to the last."""


@dataclass(frozen=True)
class LandmarkTargets:
    """Where landmarks should come to lie: points [468, 3] and trust [468] as in Landmarks; hold [468]: how much longer
    one counts than the others (lips and lids); fixed bool [468]: those that are where they are said to be, whatever the
    scan says (None: none)."""

    points: np.ndarray
    trust: np.ndarray
    hold: np.ndarray
    fixed: np.ndarray | None = None


def fit(
    model: HeadModel,
    start: np.ndarray,
    scan: Scan,
    follow: np.ndarray,
    targets: LandmarkTargets,
    iterations: int,
    progress: Callable[[float], None] = lambda share: None,
) -> np.ndarray:
    """A head drawn onto a scan. Nothing is known of what the mesh is but these arrays.

    Parameters
    ----------
    model : the topology, and where the landmarks are on it
    start : [V, 3] in metres, the aligned head
    scan : in the same world
    follow : [V] in [0, 1], how far the scan is believed
    targets : of the landmarks
    iterations : from stiff to soft
    progress : hears the share that is done, in [0, 1)

    Returns
    -------
    Vertices [V, 3] in metres.
    """
    points, trust, hold, put = targets.points, targets.trust, targets.hold, targets.fixed
    area, laplacian = operators(model.mesh.moved(start))
    marks = anchors(model)
    known = np.isfinite(points).all(1) & (trust * model.landmark_weight > 0)
    put = np.zeros(len(points), bool) if put is None else put & known
    vertices = start.copy()
    for step in range(iterations):
        progress(step / iterations)
        ramp = step / max(iterations - 1, 1)
        length = STIFF_M * (SOFT_M / STIFF_M) ** ramp
        normals = vertex_normals(model.mesh.moved(vertices))
        reach = FAR_M * (NEAR_M / FAR_M) ** ramp
        signed, scan_normals = scan.match(vertices, normals, 1.5 * reach)
        data = trimmed(np.where(follow > 0.02, signed, np.nan), reach) * follow
        aim = vertices + scan_normals * np.nan_to_num(signed)[:, None]

        at = marks @ vertices
        miss = np.nan_to_num(points - at)
        surface = marks @ normals
        surface /= np.linalg.norm(surface, axis=1, keepdims=True)
        seen = np.where(put, 0, marks @ data)[:, None]
        miss -= seen * (miss * surface).sum(1, keepdims=True) * surface  # in depth the scan knows better
        robust = 1 / (1 + (np.linalg.norm(miss, axis=1) / 0.005) ** 2)
        pin = LANDMARK_AREA_M2[0] * (LANDMARK_AREA_M2[1] / LANDMARK_AREA_M2[0]) ** ramp * np.maximum(1, hold * ramp)
        pin = np.where(known, pin * robust * trust * model.landmark_weight, 0)

        pin[put] = PUT_AREA_M2
        blind = 1 - follow * np.isfinite(signed)
        bending = np.maximum(length, BLIND_M * blind) ** 4
        pull = PULL + (BLIND_PULL - PULL) * (1 - follow)
        matrix = (
            sparse.diags(area * (data + pull))
            + marks.T @ sparse.diags(pin) @ marks
            + laplacian.T @ sparse.diags(bending / area) @ laplacian
        )
        right = (area * data)[:, None] * (aim - start) + marks.T @ (pin[:, None] * (at + miss - marks @ start))
        # positive definite, so no pivoting: with it the factors fill up and take fifty times as long
        vertices = start + splu(
            matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        ).solve(right)
    return vertices


def flipped_triangles(before: Mesh, after: Mesh) -> int:
    """How many triangles turned over between two shapes of one topology."""
    return int(flipped(before, after.vertices).sum())


def operators(mesh: Mesh) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Area of each vertex [V] in square metres, and the cotangent Laplacian [V, V] (integrated: divide by the area for
    a mean)."""
    count = len(mesh.vertices)
    area, rows, columns, cotangents = np.zeros(count), [], [], []
    for i in range(3):
        a, b, c = (mesh.faces[:, (i + k) % 3] for k in range(3))
        u, v = mesh.vertices[b] - mesh.vertices[a], mesh.vertices[c] - mesh.vertices[a]
        double = np.maximum(np.linalg.norm(np.cross(u, v), axis=1), 1e-12)
        np.add.at(area, a, double / 6)
        rows.append(b)
        columns.append(c)
        # thin triangles must not turn stiffness into tearing
        cotangents.append(np.clip((u * v).sum(1) / double, 0.02, 5) / 2)
    rows, columns, cotangents = (np.concatenate(x) for x in (rows, columns, cotangents))
    half = sparse.coo_matrix((cotangents, (rows, columns)), (count, count)).tocsr()
    weights = half + half.T
    floor = np.median(area[area > 0]) * 0.05
    return np.maximum(area, floor), (sparse.diags(np.asarray(weights.sum(1)).ravel()) - weights).tocsr()


def anchors(model: HeadModel) -> sparse.csr_matrix:
    """[468, V]: takes vertices to landmarks."""
    corners = model.mesh.faces[model.landmark_face]
    rows = np.repeat(np.arange(len(corners)), 3)
    return sparse.coo_matrix(
        (model.landmark_bary.ravel(), (rows, corners.ravel())), (len(corners), len(model.mesh.vertices))
    ).tocsr()
