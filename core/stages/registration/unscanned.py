# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head without a scan: the identity space's nearest head under the given cameras, by landmarks, matched points and
outlines, then relaxed towards what the views agree on as far as that is told.

Gauss-Newton on a similarity and coefficients with prior N(0, 1), then thin-plate displacements as in nonrigid.py.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from ...capture.messages import Reporter
from ...geometry.meshes import Mesh
from ...geometry.views import View
from . import nonrigid, silhouettes
from .alignment import HeadModel, Similarity, fit_landmarks, stepped
from .constraints import Constraints, from_landmarks, from_points, joined
from .landmarks import Landmarks

SIGMA_M = {"landmarks": 0.0025, "points": 0.0015, "outlines": 0.0015}
"""How far each kind lies from the nearest head of the identity space, roughly: a net's marks err by themselves, the
others by what that space lacks."""
INDEPENDENT_COUNTS = {"landmarks": 120, "points": 200, "outlines": 100}
"""How many of each kind count as independent; neighbours err together."""
ROUNDS = 10
OUTLINE_PX = 960
"""Longer side of the pictures that outlines are found in."""
REACH_M = (0.012, 0.004)
"""How far a point or outline may lie off at the first and the last round."""
STIFF_M, SOFT_M = 0.030, 0.009
"""Length over which the displacement is held together, at the first and the last step: what is told lies centimetres
apart."""
AREA_M2 = {"landmarks": 0.006, "points": 0.020, "outlines": 0.006}
"""Surface area that all constraints of a kind count for in the relaxation, where there are many: a face has about 0.03
square metres."""
MOST_AREA_M2 = 4e-5
"""That a single one counts for."""
PULL = 0.02
"""Weight of staying where the identity fit is, against data of weight one."""
HELD_PULL = 10.0
"""The same for what lies on a scan."""
STEPS = 8  # of the relaxation, from STIFF_M to SOFT_M


@dataclass(frozen=True)
class Points:
    """Matched points of the cameras' model [N, 3] in metres, and the unit mean directions [N, 3] to the views that saw
    them."""

    places: np.ndarray
    towards: np.ndarray


@dataclass(frozen=True)
class FittedHead:
    """The pose and coefficients [K] of the identity fit; vertices [V, 3] after the relaxation; how many constraints of
    each kind it had, and by how much they miss in the median [m]."""

    pose: Similarity
    coefficients: np.ndarray
    vertices: np.ndarray
    used: dict[str, int]
    miss_m: dict[str, float]


@dataclass(frozen=True)
class ShownByViews:
    """What views show of a head: the landmarks found in them with their trust [468], matched points, and follow [V] in
    [0, 1]: which part of the head they are believed about."""

    views: list[View]
    landmarks: Landmarks
    trust: np.ndarray
    points: Points
    follow: np.ndarray


@dataclass(frozen=True)
class _ViewConstraints:
    """What draws a head towards what its views show: with the outlines in them, and the mesh's edges."""

    model: HeadModel
    evidence: ShownByViews
    outlines: list
    edges: np.ndarray

    def of(self, mesh: Mesh, reach: float) -> dict[str, Constraints]:
        """By kind, for a head as it lies now. reach: metres by which a point or outline may lie off."""
        shown = self.evidence
        return {
            "landmarks": from_landmarks(
                self.model, mesh.vertices, shown.views, shown.landmarks, shown.trust, max(reach, 0.006)
            ),
            "points": from_points(mesh, shown.follow, shown.points.places, shown.points.towards, reach),
            "outlines": joined(
                [silhouettes.compare(outline, mesh, self.edges, shown.follow, reach) for outline in self.outlines]
            ),
        }


def fit(model: HeadModel, evidence: ShownByViews, report: Reporter, first: float, steps: float) -> FittedHead:
    """The head that the views show.

    Parameters
    ----------
    model : the template with its identity space
    evidence : what is to be explained, in metres
    report : hears of progress, from `first` to `steps`
    first, steps : where the progress of this part of the stage begins, and where it ends

    Returns
    -------
    The fit, in the world of the views, metres.
    """
    landmarks = evidence.landmarks
    pose, coefficients = fit_landmarks(model, landmarks.points, evidence.trust)
    start = model.mesh.moved(pose.apply(model.shape(coefficients)))
    constraints = _view_constraints(
        model, start, evidence, lambda share, what: report.progress(first + 0.4 * (steps - first) * share, steps, what)
    )
    parts: dict[str, Constraints] = {}
    for step in range(ROUNDS):
        report.progress(first + (steps - first) * (0.4 + 0.3 * step / ROUNDS), steps, "finding the nearest head")
        mesh = model.mesh.moved(pose.apply(model.shape(coefficients)))
        parts = constraints.of(mesh, np.interp(step, [0, ROUNDS - 1], REACH_M))
        rows = []
        for name, ties in parts.items():
            basis = ties.at(model.identity)  # [K, M, 3]
            weight = ties.weight * min(1.0, INDEPENDENT_COUNTS[name] / max(ties.weight.sum(), 1)) / SIGMA_M[name] ** 2
            rows.append((ties.at(mesh.vertices), basis, ties.direction, ties.distance, weight))
        pose, coefficients = stepped(pose, coefficients, rows)
    vertices = pose.apply(model.shape(coefficients))

    def tell(step: int) -> None:
        report.progress(first + (steps - first) * (0.7 + 0.3 * step / STEPS), steps, "fitting the head to the views")

    vertices = _relaxed(model, vertices, lambda mesh: constraints.of(mesh, REACH_M[1]), landmarks, tell)
    parts = constraints.of(model.mesh.moved(vertices), REACH_M[1])
    return FittedHead(
        pose,
        coefficients,
        vertices,
        {name: len(ties) for name, ties in parts.items()},
        {name: float(np.median(np.abs(ties.distance))) if len(ties) else float("nan") for name, ties in parts.items()},
    )


def beyond_scan(
    model: HeadModel,
    vertices: np.ndarray,
    on_scan: np.ndarray,
    evidence: ShownByViews,
    report: Reporter,
    first: float,
    steps: float,
) -> np.ndarray:
    """A head that lies on a scan, where the scan ends drawn towards what the views show: jaw, temples and ears are seen
    as outlines and matched points long before a dense surface of them can be measured.

    Parameters
    ----------
    model : the template
    vertices : [V, 3] in metres, as the scan's fit left them
    on_scan : bool [V]: they lie on the scan, and stay
    evidence : what is to be explained, in the same world
    report : hears of progress, from `first` to `steps`
    first, steps : where the progress of this part of the stage begins, and where it ends

    Returns
    -------
    Vertices [V, 3].
    """
    all_of_it = _view_constraints(
        model,
        model.mesh.moved(vertices),
        evidence,
        lambda share, what: report.progress(first + 0.8 * (steps - first) * share, steps, what),
    )
    constraints = replace(all_of_it, evidence=replace(evidence, follow=np.where(on_scan, 0, evidence.follow)))

    def tell(step: int) -> None:
        report.progress(first + (steps - first) * (0.8 + 0.2 * step / STEPS), steps, "fitting the head beyond the scan")

    def told(mesh: Mesh) -> dict[str, Constraints]:
        return {name: ties for name, ties in constraints.of(mesh, REACH_M[0]).items() if name != "landmarks"}

    return _relaxed(model, vertices, told, evidence.landmarks, tell, np.where(on_scan, HELD_PULL, PULL))


def _view_constraints(
    model: HeadModel, start: Mesh, evidence: ShownByViews, tell: Callable[[float, str], None]
) -> _ViewConstraints:
    """With the outlines of the views' pictures, which are found about the head `start`; tell(share done, what)."""
    outlines, views = [], evidence.views
    for i, view in enumerate(views):
        tell(i / len(views), f"looking for the outline of the face in {view.name}")
        scale = min(1.0, OUTLINE_PX / max(view.width, view.height))
        outlines.append(silhouettes.prepare(view, start, evidence.follow, scale))
    return _ViewConstraints(model, evidence, outlines, silhouettes.edges_of(model.mesh))


def _relaxed(
    model: HeadModel, start: np.ndarray, constraints, landmarks: Landmarks, tick, pull: np.ndarray | float = PULL
) -> np.ndarray:
    """Vertices [V, 3]: thin-plate displacements of `start`, stiff to soft; constraints(mesh) -> {kind: Constraints}."""
    area, laplacian = nonrigid.operators(model.mesh.moved(start))
    bending = (laplacian.T @ sparse.diags(1 / area) @ laplacian).tocsr()
    anchors = nonrigid.anchors(model)
    vertices = start.copy()
    for step in range(STEPS):
        tick(step)
        length = STIFF_M * (SOFT_M / STIFF_M) ** (step / (STEPS - 1))
        matrix, right = length**4 * bending + sparse.diags(pull * area), np.zeros_like(start)
        for name, ties in constraints(model.mesh.moved(vertices)).items():
            if not len(ties):
                continue
            weight = ties.weight * min(MOST_AREA_M2, AREA_M2[name] / max(ties.weight.sum(), 1e-9))
            picked = sparse.coo_matrix(
                (ties.bary.ravel(), (np.repeat(np.arange(len(ties)), 3), ties.corners.ravel())), (len(ties), len(start))
            ).tocsr()
            matrix = matrix + picked.T @ sparse.diags(weight) @ picked
            aim = picked @ (vertices - start) + ties.direction * ties.distance[:, None]
            right += picked.T @ (weight[:, None] * aim)
        if landmarks.by_artist.any():
            pins = sparse.diags(np.where(landmarks.by_artist, nonrigid.PUT_AREA_M2, 0.0))
            matrix = matrix + anchors.T @ pins @ anchors
            right += anchors.T @ (pins @ (np.nan_to_num(landmarks.points) - anchors @ start))
        solver = splu(
            matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
        vertices = start + solver.solve(right)
    return vertices
