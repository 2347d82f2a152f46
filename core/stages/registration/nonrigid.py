# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Non-rigid fit of the last millimetres: a smooth displacement of every vertex onto the scan, stiff to soft.

Minimises data + thin-plate bending of the displacement by sparse least squares, as optimal-step non-rigid ICP does
(Amberg, Romdhani, Vetter 2007). A vertex is drawn to its scan patch along the patch's normal only, so the mesh slides
along the surface; where there is no data (ears, scalp, neck, holes) stiffness stays high and the shape follows.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from ...geometry.meshes import Mesh, unit, vertex_normals
from .alignment import HeadModel
from .correspondence import Scan, biweight

STIFF_M, SOFT_M = 0.030, 0.0022  # length over which the displacement is held together, at the first and the last step
BLIND_M = 0.020  # minimum of that length where the scan is not followed
FAR_M, NEAR_M = 0.030, 0.002  # distance beyond which a scan patch is no partner, at the first and the last step
PULL, BLIND_PULL = 1e-3, 2e-2
"""Weight of staying at the identity fit, against data of weight one; and where the scan is not followed, lest the crown
overshoot."""
LANDMARK_AREA_M2 = (3e-4, 3e-6)  # surface area that one landmark counts for, at the first and the last step

PUT_AREA_M2 = 1e-3  # area of a landmark that the artist has put, at all steps


@dataclass(frozen=True)
class LandmarkTargets:
    """Targets of the landmarks.

    points [468, 3] and trust [468] as in Landmarks; hold [468]: how much longer one counts than the others (lips and
    lids); fixed bool [468]: those to hold whatever the scan says (None: none).
    """

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
    """Draw an aligned head, vertices [V, 3] in metres, onto a scan.

    follow [V] in [0, 1] is the weight of the scan; iterations go from stiff to soft; progress hears the share that is
    done. Only these arrays are known of the mesh.
    """
    points, trust, hold, fixed = targets.points, targets.trust, targets.hold, targets.fixed
    area, laplacian = operators(model.mesh.moved(start))
    marks = anchors(model)
    valid = np.isfinite(points).all(1) & (trust * model.landmark_weight > 0)
    fixed = np.zeros(len(points), bool) if fixed is None else fixed & valid
    vertices = start.copy()
    for step in range(iterations):
        progress(step / iterations)
        ramp = step / max(iterations - 1, 1)
        length = STIFF_M * (SOFT_M / STIFF_M) ** ramp
        normals = vertex_normals(model.mesh.moved(vertices))
        reach = FAR_M * (NEAR_M / FAR_M) ** ramp
        signed, scan_normals = scan.match(vertices, normals, 1.5 * reach)
        data = biweight(np.where(follow > 0.02, signed, np.nan), reach) * follow
        aim = vertices + scan_normals * np.nan_to_num(signed)[:, None]

        at = marks @ vertices
        miss = np.nan_to_num(points - at)
        surface = unit(marks @ normals)
        scan_share = np.where(fixed, 0, marks @ data)[:, None]
        miss -= scan_share * (miss * surface).sum(1, keepdims=True) * surface  # in depth the scan is more precise
        robust = 1 / (1 + (np.linalg.norm(miss, axis=1) / 0.005) ** 2)
        pin = LANDMARK_AREA_M2[0] * (LANDMARK_AREA_M2[1] / LANDMARK_AREA_M2[0]) ** ramp * np.maximum(1, hold * ramp)
        pin = np.where(valid, pin * robust * trust * model.landmark_weight, 0)

        pin[fixed] = PUT_AREA_M2
        blind = 1 - follow * np.isfinite(signed)
        bending = np.maximum(length, BLIND_M * blind) ** 4
        pull = PULL + (BLIND_PULL - PULL) * (1 - follow)
        matrix = (
            sparse.diags(area * (data + pull))
            + marks.T @ sparse.diags(pin) @ marks
            + laplacian.T @ sparse.diags(bending / area) @ laplacian
        )
        right = (area * data)[:, None] * (aim - start) + marks.T @ (pin[:, None] * (at + miss - marks @ start))
        vertices = start + solve_definite(matrix, right)
    return vertices


def solve_definite(matrix: sparse.spmatrix, right: np.ndarray) -> np.ndarray:
    """Solve a positive definite sparse system.

    There is no need to pivot: with it the factors fill up and take fifty times as long.
    """
    options = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    return splu(matrix.tocsc(), **options).solve(right)


def operators(mesh: Mesh) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Return the area of each vertex [V] in square metres, and the cotangent Laplacian [V, V].

    It is integrated: divide by the area for a mean.
    """
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
    """Return the matrix [468, V] that takes vertices to landmarks."""
    return interpolation(model.mesh.faces[model.landmark_face], model.landmark_bary, len(model.mesh.vertices))


def interpolation(corners: np.ndarray, bary: np.ndarray, vertices: int) -> sparse.csr_matrix:
    """Return the matrix [M, V] that takes vertices to the places at corners [M, 3] with barycentric bary [M, 3]."""
    rows = np.repeat(np.arange(len(corners)), 3)
    return sparse.coo_matrix((bary.ravel(), (rows, corners.ravel())), (len(corners), vertices)).tocsr()
