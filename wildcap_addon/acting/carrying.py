# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer the template's face units to a registered head.

Each displacement is turned and scaled as its neighbourhood was between the two, in the spirit of deformation transfer
(Sumner and Popovic 2004): a similarity per vertex, fitted over about a centimetre, instead of an affine map per
triangle. No equations are solved, and neighbours such as the two lips keep moving alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .asset import HALF, JAWS, LEFT_EYE, RIGHT_EYE, SIDES, SOFT, FaceUnits, lining
from .filmed import FilmedEyes

STEPS = 80
"""Rounds of averaging: a neighbourhood reaches about 7 mm (lids) to 20 mm (cheeks)."""
CORNEA = (0.06, 0.52)
"""Height as a share of the eyeball's radius, and half width in radians."""
CLEAR_M = 0.0005
"""Gap between eyeball and lids."""
BEHIND_M = 0.002
"""Gap between teeth and lips."""
HELD_M = 0.01
"""Depth behind a rim at which the mouth's lining follows jaws and rim equally.

A rim's similarity is fitted over this much: the throat, ten times as deep, would swing by centimetres."""
MOUTH_M = 0.045
"""Reach of the similarity that carries the jaws."""
FORWARD = (0, -1, 0)


@dataclass(frozen=True)
class Similarity:
    """Rotation times scale [3, 3], and where it takes `source` [3]."""

    matrix: np.ndarray
    source: np.ndarray
    target: np.ndarray

    def __call__(self, points: np.ndarray) -> np.ndarray:
        return self.target + (points - self.source) @ self.matrix.T


@dataclass(frozen=True)
class CarriedBall(Similarity):
    radius: float

    def surface(self, direction: np.ndarray) -> np.ndarray:
        """Return the distance of the surface with its cornea from the centre along unit vectors [n, 3]."""
        gaze = self.matrix @ FORWARD
        angle = np.arccos(np.clip(direction @ gaze / np.linalg.norm(gaze), -1, 1))
        return self.radius * (1 + CORNEA[0] * np.clip(1 - (angle / CORNEA[1]) ** 2, 0, None))


def carried(
    asset: FaceUnits, head: np.ndarray, filmed: FilmedEyes | None = None
) -> tuple[np.ndarray, dict[str, tuple[np.ndarray, np.ndarray]]]:
    """Return the vertices [V + C + P, 3] of the cut head at rest, and rows and displacements of each unit.

    head: registered vertices [V, 3]. The units include, by HALF and a side, what keeps the lids off the eyeball half
    way. With filmed eyes the eyeballs are those, and `eyesOpen` opens the lids as far as they were.
    """
    turn = frames(asset.triangles, asset.template, head)  # [V, 3, 3]
    parts, turns = _carry_soft(asset, head, turn)
    balls = [_carry_ball(asset, head, kind, filmed) for kind in (LEFT_EYE, RIGHT_EYE)]
    for kind, ball in zip((LEFT_EYE, RIGHT_EYE), balls, strict=True):
        rows = asset.kind == kind
        parts[rows], turns[rows] = ball(asset.parts[rows]), ball.matrix
    mouth = lining(asset)
    _carry_jaws(asset, head, mouth, parts, turns)
    rest, turns = np.concatenate([head, head[asset.copies], parts]), np.concatenate([turn, turn[asset.copies], turns])
    units = {name: (rows, np.einsum("nij,nj->ni", turns[rows], moves)) for name, (rows, moves) in asset.units.items()}
    for side, ball in zip(SIDES, balls, strict=True):
        rows, moves = units[f"eyesOpen{side}"]
        lids = ~np.isin(rows, asset.first_inner + mouth)  # the top of the palate is no lid
        rows, moves = rows[lids], moves[lids]
        moves = moves + _outwards(rest[rows] + moves, ball) if filmed is None else _as_filmed(rest, rows, moves, filmed)
        units[f"eyesOpen{side}"], units[f"eyeBlink{side}"] = (rows, moves), (rows, -moves)
        units[f"{HALF}{side}"] = rows, _outwards(rest[rows] + moves / 2, ball)
    return rest, units


def _carry_soft(asset: FaceUnits, head: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return inner vertices [P, 3] and their similarities [P, 3, 3], filled in where they are soft."""
    soft = asset.kind == SOFT
    anchors, weights = asset.anchors[soft], asset.weights[soft][..., None]
    parts, turns = np.empty_like(asset.parts), np.empty((len(asset.parts), 3, 3))
    arm = asset.parts[soft][:, None] - asset.template[anchors]
    parts[soft] = (weights * (head[anchors] + np.einsum("pkij,pkj->pki", turn[anchors], arm))).sum(1)
    turns[soft] = (weights[..., None] * turn[anchors]).sum(1)
    return parts, turns


def _carry_ball(asset: FaceUnits, head: np.ndarray, kind: int, filmed: FilmedEyes | None) -> CarriedBall:
    ball = asset.balls[kind - LEFT_EYE]
    if filmed is not None:
        eye = filmed.eyes[kind - LEFT_EYE]
        rows = np.flatnonzero(asset.kind == kind)
        pupil = asset.parts[rows[np.linalg.norm(asset.uvs[rows] - 0.5, axis=1).argmin()]] - ball[:3]
        turn = _towards(pupil / np.linalg.norm(pupil)).T
        matrix = eye.radius / ball[3] * _towards(np.array(eye.gaze)) @ turn
        return CarriedBall(matrix, ball[:3], np.array(eye.centre), eye.radius)
    fitted = _fit_around(asset, head, ball[:3], 2 * ball[3])
    radius = ball[3] * np.cbrt(np.linalg.det(fitted.matrix))
    return _behind_lids(asset, head, CarriedBall(fitted.matrix, ball[:3], fitted.target, radius), ball[3])


def _carry_jaws(asset: FaceUnits, head: np.ndarray, mouth: np.ndarray, parts: np.ndarray, turns: np.ndarray) -> None:
    """Fill in the jaws, and have the depths of the mouth's lining [n] follow them."""
    jaws = asset.kind == JAWS
    fitted = _fit_around(asset, head, asset.parts[jaws].mean(0), MOUTH_M)
    parts[jaws], turns[jaws] = fitted(asset.parts[jaws]), fitted.matrix
    back = _behind_lips(asset, head, parts[jaws])
    parts[jaws] += back
    away = np.linalg.norm(asset.parts[mouth, None] - asset.template[asset.anchors[mouth]], axis=2)
    away = (asset.weights[mouth] * away).sum(1)[:, None]
    deep = away**2 / (away**2 + HELD_M**2)
    parts[mouth] += deep * (fitted(asset.parts[mouth]) + back - parts[mouth])
    turns[mouth] += deep[..., None] * (fitted.matrix - turns[mouth])


def _as_filmed(rest_points: np.ndarray, rows: np.ndarray, moves: np.ndarray, filmed: FilmedEyes) -> np.ndarray:
    """Return displacements [n, 3] that open the lids to where they were; vertices not in the capture keep theirs."""
    index = np.full(len(rest_points), -1)
    index[filmed.rows] = np.arange(len(filmed.rows))
    is_filmed = index[rows] >= 0
    moves = moves.copy()
    moves[is_filmed] = filmed.places[index[rows[is_filmed]]] - rest_points[rows[is_filmed]]
    return moves


def _towards(gaze: np.ndarray) -> np.ndarray:
    """Return the rotation [3, 3] from straight ahead (-y) to the unit vector gaze [3], without roll."""
    side = np.cross([0, 0, 1.0], gaze)
    side /= np.linalg.norm(side)
    return np.stack([side, -gaze, np.cross(gaze, side)], -1)


def frames(triangles: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return rotation times scale [V, 3, 3] of each vertex's neighbourhood between two shapes [V, 3] of one mesh.

    Least squares over moments that spread along the edges.
    """
    count = len(before)
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges = np.unique(np.sort(sides, 1), axis=0)
    edges = np.concatenate([edges, edges[:, ::-1], np.arange(count)[:, None].repeat(2, 1)])
    edges = edges[np.argsort(edges[:, 0], kind="stable")]
    starts = np.searchsorted(edges[:, 0], np.arange(count))
    degree = np.diff(np.append(starts, len(edges)))[:, None]
    p, q, r = (before[triangles[:, corner]] for corner in range(3))
    area = np.bincount(triangles.ravel(), np.linalg.norm(np.cross(q - p, r - p), axis=1).repeat(3), count)[:, None]
    outer = (after[:, :, None] * before[:, None]).reshape(-1, 9)
    columns = [np.ones((count, 1)), before, after, (before**2).sum(1, keepdims=True), outer]  # [V, 17]
    moments = area / area.mean() * np.concatenate(columns, 1)
    moments, degree = moments.astype(np.float32), degree.astype(np.float32)
    for _ in range(STEPS):
        moments = np.add.reduceat((moments / degree)[edges[:, 1]], starts)
    moments = (moments / moments[:, :1]).astype(np.float64)
    b, a = moments[:, 1:4], moments[:, 4:7]
    covariance = moments[:, 8:].reshape(-1, 3, 3) - a[:, :, None] * b[:, None]
    return _rotation_and_scale(covariance, moments[:, 7] - (b**2).sum(1))


def _rotation_and_scale(covariance: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Return Umeyama's similarity from covariances [..., 3, 3] of target with source and source variances [...]."""
    u, singular_values, vt = np.linalg.svd(covariance)
    sign = np.ones_like(singular_values)
    sign[..., 2] = np.sign(np.linalg.det(u @ vt))
    scale = (singular_values * sign).sum(-1) / np.maximum(variance, 1e-12)
    return (u * sign[..., None, :]) @ vt * scale[..., None, None]


def _fit_around(asset: FaceUnits, head: np.ndarray, point: np.ndarray, reach: float) -> Similarity:
    """Fit the similarity from template to head around a point of the template."""
    weight = np.clip(1 - np.linalg.norm(asset.template - point, axis=1) / reach, 0, None)[:, None]
    weight = weight / weight.sum()
    b, a = (weight * asset.template).sum(0), (weight * head).sum(0)
    source, target = asset.template - b, head - a
    matrix = _rotation_and_scale((weight * target).T @ source, (weight[:, 0] * (source**2).sum(1)).sum())
    return Similarity(matrix, point, a + matrix @ (point - b))


def _behind_lids(asset: FaceUnits, head: np.ndarray, ball: CarriedBall, template_radius: float) -> CarriedBall:
    """Move an eyeball along its gaze until the closed lids clear it."""
    gaze = ball.matrix @ FORWARD / np.linalg.norm(ball.matrix @ FORWARD)
    arm = asset.template - ball.source
    lids = head[(np.linalg.norm(arm, axis=1) < 1.35 * template_radius) & (arm[:, 1] < -0.3 * template_radius)]

    def clearance(back: float) -> float:
        v = lids - (ball.target - back * gaze)
        length = np.linalg.norm(v, axis=1)
        return (length - ball.surface(v / length[:, None])).min()

    low, high = -0.003, 0.012
    for _ in range(24):
        middle = (low + high) / 2
        low, high = (low, middle) if clearance(middle) > CLEAR_M else (middle, high)
    return CarriedBall(ball.matrix, ball.source, ball.target - high * gaze, ball.radius)


def _behind_lips(asset: FaceUnits, head: np.ndarray, jaws: np.ndarray) -> np.ndarray:
    """Return how far [3] teeth and tongue move back to clear the closed lips."""
    seam = asset.template[asset.copies]
    mouth = seam[seam[:, 2] < -0.02].mean(0)  # the other seams are the lids'
    front = head[np.linalg.norm(asset.template - mouth, axis=1) < 0.035]
    gap = np.linalg.norm((jaws[:, None] - front[None])[..., [0, 2]], axis=2)
    depth = jaws[:, 1] - front[gap.argmin(1), 1]
    return np.array([0, max(0.0, BEHIND_M - depth[gap.min(1) < 0.003].min(initial=BEHIND_M)), 0])


def _outwards(points: np.ndarray, ball: CarriedBall) -> np.ndarray:
    """Return what takes points [n, 3] of the lids out of the eyeball, [n, 3]."""
    v = points - ball.target
    length = np.linalg.norm(v, axis=1)
    v = v / length[:, None]
    inside = np.clip(ball.surface(v) + CLEAR_M - length, 0, 0.003)
    front = v @ (ball.matrix @ FORWARD) > 0
    return v * (inside * front)[:, None]
