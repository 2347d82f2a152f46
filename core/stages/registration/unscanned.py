# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Head without a scan: the identity space's nearest head by landmarks, matched points and outlines, then relaxed.

Gauss-Newton on a similarity and coefficients with prior N(0, 1), then thin-plate displacements as in nonrigid.py,
towards what the views agree on.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sparse

from ...geometry.meshes import Mesh
from ...geometry.views import View
from . import nonrigid, silhouettes
from .alignment import HeadModel, Similarity, fit_landmarks, step_towards
from .constraints import Constraints, from_landmarks, from_points, join
from .landmarks import Landmarks

SIGMA_M = {"landmarks": 0.0025, "points": 0.0015, "outlines": 0.0015}
"""Deviation of each kind from the nearest head of the identity space: a network's marks err by themselves, the others
by what that space lacks."""
INDEPENDENT_COUNTS = {"landmarks": 120, "points": 200, "outlines": 100}
"""Number of each kind that count as independent; neighbours err together."""
ROUNDS = 10
OUTLINE_PX = 960  # longer side of the pictures that outlines are found in
REACH_M = (0.012, 0.004)  # maximum distance of a point or outline, at the first and the last round
STIFF_M, SOFT_M = 0.030, 0.009
"""Length over which the displacement is held together, at the first and the last step: the evidence lies centimetres
apart."""
AREA_M2 = {"landmarks": 0.006, "points": 0.020, "outlines": 0.006}
"""Surface area that all constraints of a kind count for in the relaxation, where there are many: a face has about 0.03
square metres."""
MOST_AREA_M2 = 4e-5  # maximum area of a single constraint
PULL = 0.02  # weight of staying at the identity fit, against data of weight one
HELD_PULL = 10.0  # weight of staying on a scan
STEPS = 8  # of the relaxation, from STIFF_M to SOFT_M


@dataclass(frozen=True)
class Points:
    """Matched points of the cameras' model [N, 3] in metres, and the unit mean directions [N, 3] to their views."""

    places: np.ndarray
    towards: np.ndarray


@dataclass(frozen=True)
class FittedHead:
    """Result of the fit.

    pose and coefficients [K] of the identity fit; vertices [V, 3] after the relaxation; number of constraints of each
    kind, and their median miss [m].
    """

    pose: Similarity
    coefficients: np.ndarray
    vertices: np.ndarray
    used: dict[str, int]
    miss_m: dict[str, float]


@dataclass(frozen=True)
class ShownByViews:
    """Evidence of the views.

    The landmarks found in them with their trust [468], matched points, and follow [V] in [0, 1]: the weight of each
    vertex.
    """

    views: list[View]
    landmarks: Landmarks
    trust: np.ndarray
    points: Points
    follow: np.ndarray


@dataclass(frozen=True)
class _ViewConstraints:
    """Constraints of the views on a head, with the outlines in them and the mesh's edges."""

    model: HeadModel
    evidence: ShownByViews
    outlines: list
    edges: np.ndarray

    def of(self, mesh: Mesh, reach: float) -> dict[str, Constraints]:
        """Return constraints by kind for a head as it lies now; reach in metres limits points and outlines."""
        evidence = self.evidence
        return {
            "landmarks": from_landmarks(
                self.model, mesh.vertices, evidence.views, evidence.landmarks, evidence.trust, max(reach, 0.006)
            ),
            "points": from_points(mesh, evidence.follow, evidence.points.places, evidence.points.towards, reach),
            "outlines": join(
                [silhouettes.compare(outline, mesh, self.edges, evidence.follow, reach) for outline in self.outlines]
            ),
        }


def fit(model: HeadModel, evidence: ShownByViews, progress: Callable[[float, str], None]) -> FittedHead:
    """Fit a head to the views, in their world; progress receives the share done and of what."""
    pose, coefficients = fit_landmarks(model, evidence.landmarks.points, evidence.trust)
    start = model.mesh.moved(pose.apply(model.shape(coefficients)))
    constraints = _view_constraints(model, start, evidence, lambda share, text: progress(0.4 * share, text))
    for step in range(ROUNDS):
        progress(0.4 + 0.3 * step / ROUNDS, "finding the nearest head")
        mesh = model.mesh.moved(pose.apply(model.shape(coefficients)))
        rows = []
        for name, ties in constraints.of(mesh, np.interp(step, [0, ROUNDS - 1], REACH_M)).items():
            basis = ties.at(model.identity)  # [K, M, 3]
            weight = ties.weight * min(1.0, INDEPENDENT_COUNTS[name] / max(ties.weight.sum(), 1)) / SIGMA_M[name] ** 2
            rows.append((ties.at(mesh.vertices), basis, ties.direction, ties.distance, weight))
        pose, coefficients = step_towards(pose, coefficients, rows)
    vertices = _relax(
        model,
        pose.apply(model.shape(coefficients)),
        lambda mesh: constraints.of(mesh, REACH_M[1]),
        evidence.landmarks,
        lambda share: progress(0.7 + 0.3 * share, "fitting the head to the views"),
    )
    parts = constraints.of(model.mesh.moved(vertices), REACH_M[1])
    counts = {name: len(ties) for name, ties in parts.items()}
    miss_m = {name: float(np.median(np.abs(t.distance))) if len(t) else float("nan") for name, t in parts.items()}
    return FittedHead(pose, coefficients, vertices, counts, miss_m)


def beyond_scan(
    model: HeadModel,
    vertices: np.ndarray,
    on_scan: np.ndarray,
    evidence: ShownByViews,
    progress: Callable[[float, str], None],
) -> np.ndarray:
    """Return vertices [V, 3] of a head on a scan, drawn towards what the views show where the scan ends.

    Jaw, temples and ears are seen as outlines and matched points long before a dense surface of them can be measured.
    on_scan bool [V] marks vertices that stay; progress receives the share done and of what.
    """
    start = model.mesh.moved(vertices)
    constraints = _view_constraints(model, start, evidence, lambda share, text: progress(0.8 * share, text))
    constraints = replace(constraints, evidence=replace(evidence, follow=np.where(on_scan, 0, evidence.follow)))

    def without_landmarks(mesh: Mesh) -> dict[str, Constraints]:
        return {name: ties for name, ties in constraints.of(mesh, REACH_M[0]).items() if name != "landmarks"}

    return _relax(
        model,
        vertices,
        without_landmarks,
        evidence.landmarks,
        lambda share: progress(0.8 + 0.2 * share, "fitting the head beyond the scan"),
        np.where(on_scan, HELD_PULL, PULL),
    )


def _view_constraints(
    model: HeadModel, start: Mesh, evidence: ShownByViews, progress: Callable[[float, str], None]
) -> _ViewConstraints:
    """Find outlines in the views' pictures around the head `start`."""
    outlines = []
    for i, view in enumerate(evidence.views):
        progress(i / len(evidence.views), f"looking for the outline of the face in {view.name}")
        scale = min(1.0, OUTLINE_PX / max(view.width, view.height))
        outlines.append(silhouettes.prepare(view, start, evidence.follow, scale))
    return _ViewConstraints(model, evidence, outlines, silhouettes.edges_of(model.mesh))


def _relax(
    model: HeadModel, start: np.ndarray, constraints, landmarks: Landmarks, progress, pull: np.ndarray | float = PULL
) -> np.ndarray:
    """Return thin-plate displacements of `start` [V, 3], stiff to soft; constraints(mesh) -> {kind: Constraints}."""
    area, laplacian = nonrigid.operators(model.mesh.moved(start))
    bending = (laplacian.T @ sparse.diags(1 / area) @ laplacian).tocsr()
    anchors = nonrigid.anchors(model)
    vertices = start.copy()
    for step in range(STEPS):
        progress(step / STEPS)
        length = STIFF_M * (SOFT_M / STIFF_M) ** (step / (STEPS - 1))
        matrix, right = length**4 * bending + sparse.diags(pull * area), np.zeros_like(start)
        for name, ties in constraints(model.mesh.moved(vertices)).items():
            if not len(ties):
                continue
            weight = ties.weight * min(MOST_AREA_M2, AREA_M2[name] / max(ties.weight.sum(), 1e-9))
            picked = nonrigid.interpolation(ties.corners, ties.bary, len(start))
            matrix = matrix + picked.T @ sparse.diags(weight) @ picked
            aim = picked @ (vertices - start) + ties.direction * ties.distance[:, None]
            right += picked.T @ (weight[:, None] * aim)
        if landmarks.by_artist.any():
            pins = sparse.diags(np.where(landmarks.by_artist, nonrigid.PUT_AREA_M2, 0.0))
            matrix = matrix + anchors.T @ pins @ anchors
            right += anchors.T @ (pins @ (np.nan_to_num(landmarks.points) - anchors @ start))
        vertices = start + nonrigid.solve_definite(matrix, right)
    return vertices
