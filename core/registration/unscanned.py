# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head without a scan: the identity space's nearest head under the given cameras, by landmarks, matched points and outlines, then relaxed towards
what the views agree on as far as that is told.

Gauss-Newton on a similarity and coefficients with prior N(0, 1), then thin-plate displacements as in nonrigid.py.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from ..contract.messages import Reporter
from ..geometry.meshes import Mesh
from ..geometry.views import View
from . import nonrigid, silhouettes
from .alignment import HeadModel, Similarity, fit_landmarks, stepped
from .constraints import Constraints, from_landmarks, from_points, joined
from .landmarks import Landmarks

SIGMA_M = {"landmarks": 0.0025, "points": 0.0015, "outlines": 0.0015}
"""How far each kind lies from the nearest head of the identity space, roughly: a net's marks err by themselves, the others by what that space lacks."""
INDEPENDENT = {"landmarks": 120, "points": 200, "outlines": 100}
"""How many of each kind count as independent; neighbours err together."""
ROUNDS = 10
OUTLINE_PX = 960
"""Longer side of the pictures that outlines are found in."""
REACH_M = (0.012, 0.004)
"""How far a point or outline may lie off at the first and the last round."""
STIFF_M, SOFT_M = 0.030, 0.009
"""Length over which the displacement is held together, at the first and the last step: what is told lies centimetres apart."""
AREA_M2 = {"landmarks": 0.006, "points": 0.020, "outlines": 0.006}
"""Surface area that all constraints of a kind count for in the relaxation, where there are many: a face has about 0.03 square metres."""
MOST_AREA_M2 = 4e-5
"""That a single one counts for."""
PULL = 0.02
"""Weight of staying where the identity fit is, against data of weight one."""
STEPS = 8


@dataclass(frozen=True)
class Points:
    """Matched points of the cameras' model [N, 3] in metres, and the unit mean directions [N, 3] to the views that saw them."""

    places: np.ndarray
    towards: np.ndarray


@dataclass(frozen=True)
class FittedHead:
    """The pose and coefficients [K] of the identity fit; vertices [V, 3] after the relaxation; how many constraints of each kind it had, and by how much
    they miss in the median [m]."""

    pose: Similarity
    coefficients: np.ndarray
    vertices: np.ndarray
    used: dict[str, int]
    miss_m: dict[str, float]


def fit(model: HeadModel, views: list[View], found: Landmarks, trust: np.ndarray, points: Points, follow: np.ndarray, report: Reporter,
        first: float, steps: float) -> FittedHead:
    """follow [V] in [0, 1]: which part of the head the pictures are believed about; trust [468]. Progress goes from `first` to `steps`."""
    pose, coefficients = fit_landmarks(model, found.points, trust)
    start = model.mesh.moved(pose.apply(model.shape(coefficients)))
    outlines = []
    for i, view in enumerate(views):
        report.progress(first + 0.4 * (steps - first) * i / len(views), steps, f"looking for the outline of the face in {view.name}")
        outlines.append(silhouettes.prepare(view, start, follow, min(1.0, OUTLINE_PX / max(view.width, view.height))))
    edges = silhouettes.edges_of(model.mesh)
    parts: dict[str, Constraints] = {}
    for step in range(ROUNDS):
        report.progress(first + (steps - first) * (0.4 + 0.3 * step / ROUNDS), steps, "finding the nearest head")
        mesh = model.mesh.moved(pose.apply(model.shape(coefficients)))
        parts = _constraints(model, mesh, views, found, trust, points, follow, outlines, edges, np.interp(step, [0, ROUNDS - 1], REACH_M))
        rows = []
        for name, part in parts.items():
            basis = part.at(model.identity)  # [K, M, 3]
            weight = part.weight * min(1.0, INDEPENDENT[name] / max(part.weight.sum(), 1)) / SIGMA_M[name] ** 2
            rows.append((part.at(mesh.vertices), basis, part.direction, part.distance, weight))
        pose, coefficients = stepped(pose, coefficients, rows)
    vertices = pose.apply(model.shape(coefficients))
    vertices = _relaxed(model, vertices, lambda mesh: _constraints(model, mesh, views, found, trust, points, follow, outlines, edges, REACH_M[1]),
                        found, lambda step: report.progress(first + (steps - first) * (0.7 + 0.3 * step / STEPS), steps, "fitting the head to the views"))
    parts = _constraints(model, model.mesh.moved(vertices), views, found, trust, points, follow, outlines, edges, REACH_M[1])
    return FittedHead(pose, coefficients, vertices, {name: len(part) for name, part in parts.items()},
                      {name: float(np.median(np.abs(part.distance))) if len(part) else float("nan") for name, part in parts.items()})


def _constraints(model: HeadModel, mesh: Mesh, views: list[View], found: Landmarks, trust: np.ndarray, points: Points, follow: np.ndarray, outlines: list,
                 edges: np.ndarray, reach: float) -> dict[str, Constraints]:
    return {"landmarks": from_landmarks(model, mesh.vertices, views, found, trust, max(reach, 0.006)),
            "points": from_points(mesh, follow, points.places, points.towards, reach),
            "outlines": joined([silhouettes.compare(outline, mesh, edges, follow, reach) for outline in outlines])}


def _relaxed(model: HeadModel, start: np.ndarray, constraints, found: Landmarks, tick) -> np.ndarray:
    """Vertices [V, 3]: thin-plate displacements of `start`, stiff to soft; constraints(mesh) -> {kind: Constraints}."""
    area, laplacian = nonrigid.operators(model.mesh.moved(start))
    bending = (laplacian.T @ sparse.diags(1 / area) @ laplacian).tocsr()
    anchors = nonrigid.anchors(model)
    vertices = start.copy()
    for step in range(STEPS):
        tick(step)
        length = STIFF_M * (SOFT_M / STIFF_M) ** (step / (STEPS - 1))
        matrix, right = length**4 * bending + sparse.diags(PULL * area), np.zeros_like(start)
        for name, part in constraints(model.mesh.moved(vertices)).items():
            if not len(part):
                continue
            weight = part.weight * min(MOST_AREA_M2, AREA_M2[name] / max(part.weight.sum(), 1e-9))
            picked = sparse.coo_matrix((part.bary.ravel(), (np.repeat(np.arange(len(part)), 3), part.corners.ravel())), (len(part), len(start))).tocsr()
            matrix = matrix + picked.T @ sparse.diags(weight) @ picked
            aim = picked @ (vertices - start) + part.direction * part.distance[:, None]
            right += picked.T @ (weight[:, None] * aim)
        if found.put.any():
            held = sparse.diags(np.where(found.put, nonrigid.PUT_AREA_M2, 0.0))
            matrix = matrix + anchors.T @ held @ anchors
            right += anchors.T @ (held @ (np.nan_to_num(found.points) - anchors @ start))
        solver = splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        vertices = start + solver.solve(right)
    return vertices
