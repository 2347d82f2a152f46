# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The edges of the lids as a closed curve that is drawn to where, in each view, the eyeball ends: a snake (Kass et al.
1988) in space, on the eyeball."""

from __future__ import annotations

import cv2
import numpy as np

from .eye_looks import EyeLook

SMOOTH_M = 0.004
"""Length over which the curve's displacement is held together."""
SEEN_SIGMA_M, SURFACE_SIGMA_M = 0.0005, 0.0007
"""How well all views together tell where an edge lies across it, and the head how far before the ball: views around
one height hardly tell depths of a level line."""
STAY_SIGMA_M = 0.006
"""How far the edges of people's lids lie from where a head's own would, at most."""
REACH_M, SLIP_M = 0.006, 0.0015
"""How far from the curve an edge is looked for, and a miss that counts half."""
ROUNDS = 10
EDGE_BALL_SHARE = 0.5
"""Share of the ball in a pixel at its edge."""
STEP_PX = 0.2
SPARED_POINTS = 2
"""Points at either end of an edge that do not look for it: towards the corners the opening gets thinner than a
pixel."""


def fit_edges(
    looks: list[EyeLook], expected: list[np.ndarray], upper: np.ndarray, lower: np.ndarray, centre: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """The upper and the lower edge [N, 3], both from the outer corner to the inner one, that fit what all views show.

    Parameters
    ----------
    looks : what the reader saw in the views
    expected : for each, the ball's share [SIDE, SIDE] if the edges were where they begin. A lid is thick: where the
        ball ends in a picture is beside its edge
    upper, lower : where to begin
    centre : [3] of the eyeball

    Returns
    -------
    Both edges, and which share of their points any view told of.
    """
    start = np.concatenate([upper, lower[1:-1][::-1]])
    count, corner = len(start), len(upper) - 1
    identity = np.eye(count)
    bend = np.roll(identity, 1, 0) - 2 * identity + np.roll(identity, -1, 0)
    spacing = np.linalg.norm(start - np.roll(start, 1, 0), axis=1).mean()
    stiff = np.kron(bend.T @ bend, np.eye(3)) * (SMOOTH_M / spacing) ** 4 / SEEN_SIGMA_M**2
    place = np.arange(count)
    off_corner = np.minimum(np.minimum(place, count - place), np.abs(place - corner))
    asks = off_corner > SPARED_POINTS
    depth = np.linalg.norm(start - centre, axis=1)
    points, told = start.copy(), np.zeros(count, bool)
    beside = [_borders(one, share, start)[1] for one, share in zip(looks, expected, strict=True)]
    for _ in range(ROUNDS):
        blocks = np.tile(np.eye(3) / STAY_SIGMA_M**2, (count, 1, 1))
        right = (start - points) / STAY_SIGMA_M**2
        out = points - centre
        far = np.linalg.norm(out, axis=1, keepdims=True)
        out /= far
        blocks += out[:, :, None] * out[:, None] / SURFACE_SIGMA_M**2
        right += out * (depth[:, None] - far) / SURFACE_SIGMA_M**2
        told[:] = False
        for one, off in zip(looks, beside, strict=True):
            direction, away = _borders(one, one.shares.ball, points)
            away = away - off
            here = asks & np.isfinite(away)
            miss = np.where(here, np.nan_to_num(away), 0)
            weight = here / (1 + (miss / SLIP_M) ** 2) / len(looks) / SEEN_SIGMA_M**2
            blocks += weight[:, None, None] * direction[:, :, None] * direction[:, None]
            right += (weight * miss)[:, None] * direction
            told |= here
        matrix = stiff.copy()
        for i in range(count):
            matrix[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += blocks[i]
        points = points + np.linalg.solve(matrix, right.ravel() - stiff @ (points - start).ravel()).reshape(count, 3)
    closed = np.concatenate([points, points[:1]])
    return points[: corner + 1], closed[corner:][::-1], float(told[asks].mean())


def _borders(look: EyeLook, ball: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions [N, 3] across the curve `points` [N, 3] and out of the eye, as a view sees it, and how far along
    them [N] in metres the ball, by its share [SIDE, SIDE] of the crop, ends there, nan where it does not."""
    view, move = look.view, look.shares.move
    pixels, depth = view.project(points)
    at = pixels @ move[:, :2].T + move[:, 2]
    along = np.roll(at, -1, 0) - np.roll(at, 1, 0)
    normal = np.stack([along[:, 1], -along[:, 0]], 1)
    following = np.roll(at, -1, 0)
    if (at[:, 0] * following[:, 1] - following[:, 0] * at[:, 1]).sum() < 0:
        normal = -normal
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    # to a pixel of the crop
    metres = depth / view.camera.mean_focal_length() / np.sqrt(abs(np.linalg.det(move[:, :2])))
    reach = REACH_M / np.median(metres)
    steps = np.arange(-reach, reach + STEP_PX, STEP_PX)
    where = (at[:, None] + normal[:, None] * steps[:, None] - 0.5).astype(np.float32)
    share = cv2.remap(ball, where[..., 0], where[..., 1], cv2.INTER_LINEAR)
    before, after = share[:, :-1], share[:, 1:]
    ends = steps[:-1] + STEP_PX * (before - EDGE_BALL_SHARE) / np.maximum(before - after, 1e-6)
    ends = np.where((before >= EDGE_BALL_SHARE) & (after < EDGE_BALL_SHARE), ends, np.inf)
    nearest = ends[np.arange(len(at)), np.abs(ends).argmin(1)]
    across = normal @ np.linalg.inv(move[:, :2]).T
    direction = across[:, :1] * view.rotation[0] + across[:, 1:] * view.rotation[1]
    ray = points - view.centre
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    direction -= (direction * ray).sum(1, keepdims=True) * ray
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return direction, np.where(np.isfinite(nearest), nearest * metres, np.nan)
