# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The template's face units on a registered head: each displacement is turned and scaled as its neighbourhood was
between the two.

In the spirit of deformation transfer (Sumner and Popovic 2004), with a similarity for each vertex, fitted over a
centimetre around it, instead of one affine map per triangle: no equations to solve, and what moved two lips alike still
does.
"""

from __future__ import annotations

import numpy as np

from .asset import HALF, JAWS, LEFT_EYE, RIGHT_EYE, SIDES, SOFT, FaceUnits, lining
from .filmed import FilmedEyes

STEPS = 80  # of averaging: each neighbourhood reaches some 7 (lids) to 20 mm (cheeks)
CORNEA = (0.06, 0.52)  # how far it stands out, as a share of the radius, and how wide it is, radians
CLEAR_M = 0.0005  # metres between eyeball and lids
BEHIND_M = 0.002  # metres between teeth and lips
HELD_M = 0.01
"""Metres behind a rim at which what lines the mouth goes along with the jaws as much as with the rim: over so much is
a rim's neighbourhood fitted, and a throat hung ten times as far behind it would swing by centimetres."""


def carried(
    asset: FaceUnits, head: np.ndarray, filmed: FilmedEyes | None = None
) -> tuple[np.ndarray, dict[str, tuple[np.ndarray, np.ndarray]]]:
    """All vertices [V + C + P, 3] of the head cut open, at rest, and each unit's rows and displacements, for a
    registered head [V, 3]; and by HALF and a side what keeps the lids off the ball half way, where a straight line
    from shut to open would lead through it.

    filmed: eyes that were open while filming: the balls are those, and `eyesOpen` opens the lids as far as they were.
    """
    turn = frames(asset.triangles, asset.template, head)  # [V, 3, 3]
    soft = asset.kind == SOFT
    anchors, weights = asset.anchors[soft], asset.weights[soft][..., None]
    parts, turns = np.empty_like(asset.parts), np.empty((len(asset.parts), 3, 3))
    arm = asset.parts[soft][:, None] - asset.template[anchors]
    parts[soft] = (weights * (head[anchors] + np.einsum("pkij,pkj->pki", turn[anchors], arm))).sum(1)
    turns[soft] = (weights[..., None] * turn[anchors]).sum(1)
    balls = []
    for kind, ball in ((LEFT_EYE, asset.balls[0]), (RIGHT_EYE, asset.balls[1])):
        rows = asset.kind == kind
        if filmed is None:
            matrix, centre = _similarity(asset, head, ball[:3], 2 * ball[3], ball[:3])
            radius = ball[3] * np.cbrt(np.linalg.det(matrix))
            centre = _behind_lids(asset, head, ball, matrix, centre, radius)
        else:
            eye = filmed.eyes[kind - LEFT_EYE]
            centre, radius = np.array(eye.centre), eye.radius
            matrix = radius / ball[3] * _towards(np.array(eye.gaze)) @ _towards(_looks(asset, kind, ball)).T
        parts[rows], turns[rows] = centre + (asset.parts[rows] - ball[:3]) @ matrix.T, matrix
        balls.append((centre, radius, matrix))
    rows = asset.kind == JAWS
    middle = asset.parts[rows].mean(0)
    matrix, centre = _similarity(asset, head, middle, 0.045, middle)
    parts[rows], turns[rows] = centre + (asset.parts[rows] - middle) @ matrix.T, matrix
    back = _behind_lips(asset, head, parts[rows])
    parts[rows] += back
    mouth = lining(asset)
    away = np.linalg.norm(asset.parts[mouth, None] - asset.template[asset.anchors[mouth]], axis=2)
    away = (asset.weights[mouth] * away).sum(1)[:, None]
    deep = away**2 / (away**2 + HELD_M**2)
    parts[mouth] += deep * (centre + (asset.parts[mouth] - middle) @ matrix.T + back - parts[mouth])
    turns[mouth] += deep[..., None] * (matrix - turns[mouth])
    rest, turns = np.concatenate([head, head[asset.copies], parts]), np.concatenate([turn, turn[asset.copies], turns])
    units = {name: (rows, np.einsum("nij,nj->ni", turns[rows], moves)) for name, (rows, moves) in asset.units.items()}
    for side, ball in zip(SIDES, balls, strict=True):
        rows, moves = units[f"eyesOpen{side}"]
        own = ~np.isin(rows, len(head) + len(asset.copies) + mouth)  # the highest of the palate is no lid
        rows, moves = rows[own], moves[own]
        moves = moves + _outwards(rest[rows] + moves, ball) if filmed is None else _as_filmed(rest, rows, moves, filmed)
        units[f"eyesOpen{side}"], units[f"eyeBlink{side}"] = (rows, moves), (rows, -moves)
        units[f"{HALF}{side}"] = rows, _outwards(rest[rows] + moves / 2, ball)
    return rest, units


def _as_filmed(rest_points: np.ndarray, rows: np.ndarray, moves: np.ndarray, filmed: FilmedEyes) -> np.ndarray:
    """An opening [n, 3] of the lids to where they were; what the capture does not tell of (the lips' seam is none of a
    lid's) moves as the unit says."""
    place = np.full(len(rest_points), -1)
    place[filmed.rows] = np.arange(len(filmed.rows))
    known = place[rows] >= 0
    moves = moves.copy()
    moves[known] = filmed.places[place[rows[known]]] - rest_points[rows[known]]
    return moves


def _looks(asset: FaceUnits, kind: int, ball: np.ndarray) -> np.ndarray:
    """Where an eyeball looks on the template: a unit vector [3]; two degrees down."""
    rows = np.flatnonzero(asset.kind == kind)
    pupil = asset.parts[rows[np.linalg.norm(asset.uvs[rows] - 0.5, axis=1).argmin()]] - ball[:3]
    return pupil / np.linalg.norm(pupil)


def _towards(gaze: np.ndarray) -> np.ndarray:
    """The rotation [3, 3] that turns an eye from straight ahead (-y) to the unit vector gaze [3], without roll."""
    side = np.cross([0, 0, 1.0], gaze)
    side /= np.linalg.norm(side)
    return np.stack([side, -gaze, np.cross(gaze, side)], -1)


def frames(triangles: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Rotation times scale [V, 3, 3] of each vertex's neighbourhood between two shapes [V, 3] of one mesh: least
    squares over moments that spread along the edges."""
    count = len(before)
    edges = np.unique(
        np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), 1), axis=0
    )
    edges = np.concatenate([edges, edges[:, ::-1], np.arange(count)[:, None].repeat(2, 1)])
    edges = edges[np.argsort(edges[:, 0], kind="stable")]
    starts = np.searchsorted(edges[:, 0], np.arange(count))
    degree = np.diff(np.append(starts, len(edges)))[:, None]
    normal = np.cross(
        before[triangles[:, 1]] - before[triangles[:, 0]], before[triangles[:, 2]] - before[triangles[:, 0]]
    )
    area = np.bincount(triangles.ravel(), np.linalg.norm(normal, axis=1).repeat(3), count)[:, None]
    outer = (after[:, :, None] * before[:, None]).reshape(-1, 9)
    # [V, 17]
    columns = [np.ones((count, 1)), before, after, (before**2).sum(1, keepdims=True), outer]
    moments = area / area.mean() * np.concatenate(columns, 1)
    moments, degree = moments.astype(np.float32), degree.astype(np.float32)
    for _ in range(STEPS):
        moments = np.add.reduceat((moments / degree)[edges[:, 1]], starts)
    moments = (moments / moments[:, :1]).astype(np.float64)
    b, a = moments[:, 1:4], moments[:, 4:7]
    covariance = moments[:, 8:].reshape(-1, 3, 3) - a[:, :, None] * b[:, None]
    return _rotation_and_scale(covariance, moments[:, 7] - (b**2).sum(1))


def _rotation_and_scale(covariance: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Umeyama's similarity: covariance [..., 3, 3] of target with source, variance [...] of the source."""
    u, singular_values, vt = np.linalg.svd(covariance)
    sign = np.ones_like(singular_values)
    sign[..., 2] = np.sign(np.linalg.det(u @ vt))
    scale = (singular_values * sign).sum(-1) / np.maximum(variance, 1e-12)
    return (u * sign[..., None, :]) @ vt * scale[..., None, None]


def _similarity(
    asset: FaceUnits, head: np.ndarray, around: np.ndarray, reach: float, point: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rotation times scale [3, 3] of the head around a point of the template, and where the similarity takes
    `point`."""
    weight = np.clip(1 - np.linalg.norm(asset.template - around, axis=1) / reach, 0, None)[:, None]
    weight = weight / weight.sum()
    b, a = (weight * asset.template).sum(0), (weight * head).sum(0)
    source, target = asset.template - b, head - a
    matrix = _rotation_and_scale((weight * target).T @ source, (weight[:, 0] * (source**2).sum(1)).sum())
    return matrix, a + matrix @ (point - b)


def _surface(direction: np.ndarray, matrix: np.ndarray, radius: float) -> np.ndarray:
    """Distance of the eyeball's surface, cornea and all, from its centre along directions [n, 3] of length 1."""
    gaze = matrix @ [0, -1, 0]
    angle = np.arccos(np.clip(direction @ gaze / np.linalg.norm(gaze), -1, 1))
    return radius * (1 + CORNEA[0] * np.clip(1 - (angle / CORNEA[1]) ** 2, 0, None))


def _behind_lids(
    asset: FaceUnits, head: np.ndarray, ball: np.ndarray, matrix: np.ndarray, centre: np.ndarray, radius: float
) -> np.ndarray:
    """The eyeball's centre, moved along its gaze until the closed lids clear it."""
    gaze = matrix @ [0, -1, 0] / np.linalg.norm(matrix @ [0, -1, 0])
    arm = asset.template - ball[:3]
    lids = head[(np.linalg.norm(arm, axis=1) < 1.35 * ball[3]) & (arm[:, 1] < -0.3 * ball[3])]

    def clearance(back: float) -> float:
        v = lids - (centre - back * gaze)
        length = np.linalg.norm(v, axis=1)
        return (length - _surface(v / length[:, None], matrix, radius)).min()

    low, high = -0.003, 0.012
    for _ in range(24):
        middle = (low + high) / 2
        low, high = (low, middle) if clearance(middle) > CLEAR_M else (middle, high)
    return centre - high * gaze


def _behind_lips(asset: FaceUnits, head: np.ndarray, jaws: np.ndarray) -> np.ndarray:
    """How far teeth and tongue go back so that they clear the closed lips, [3]."""
    seam = asset.template[asset.copies]
    mouth = seam[seam[:, 2] < -0.02].mean(0)  # the other seams are the lids'
    front = head[np.linalg.norm(asset.template - mouth, axis=1) < 0.035]
    gap = np.linalg.norm((jaws[:, None] - front[None])[..., [0, 2]], axis=2)
    nearest = gap.argmin(1)
    depth = jaws[:, 1] - front[nearest, 1]
    return np.array([0, max(0.0, BEHIND_M - depth[gap.min(1) < 0.003].min(initial=BEHIND_M)), 0])


def _outwards(points: np.ndarray, ball: tuple[np.ndarray, float, np.ndarray]) -> np.ndarray:
    """What takes points [n, 3] of the lids out of the eyeball, [n, 3]."""
    centre, radius, matrix = ball
    v = points - centre
    length = np.linalg.norm(v, axis=1)
    v = v / length[:, None]
    inside = np.clip(_surface(v, matrix, radius) + CLEAR_M - length, 0, 0.003)
    front = v @ (matrix @ [0, -1, 0]) > 0
    return v * (inside * front)[:, None]
