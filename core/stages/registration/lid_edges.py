# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Edges of the lids as a closed curve on the eyeball: a snake (Kass et al. 1988) in space, drawn to the ball's end."""

import cv2
import numpy as np

from ...geometry.meshes import unit
from .eye_looks import EyeLook

SMOOTH_M = 0.004  # length over which the curve's displacement is held together
SEEN_SIGMA_M, SURFACE_SIGMA_M = 0.0005, 0.0007
"""Deviation of an edge across itself in all views together, and of its distance before the ball on the head: views
around one height hardly show depths of a level line."""
STAY_SIGMA_M = 0.006  # deviation of the edges of people's lids from those of a head's own, at most
REACH_M, SLIP_M = 0.006, 0.0015  # search range of an edge from the curve, and the miss that counts half
ROUNDS = 10
EDGE_BALL_SHARE = 0.5  # share of the ball in a pixel at its edge
STEP_PX = 0.2
SPARED_POINTS = 2
"""Points at either end of an edge that are not fitted: towards the corners the opening is thinner than a pixel."""


def fit_edges(
    looks: list[EyeLook], expected: list[np.ndarray], upper: np.ndarray, lower: np.ndarray, centre: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Fit the upper and the lower edge [N, 3], from the outer corner to the inner one, to all views.

    expected holds each view's share of the ball [SIDE, SIDE] if the edges were where they begin: a lid is thick, so in
    a picture the ball ends beside the edge. centre [3] is the eyeball's. Also returns the share of points that any view
    shows.
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
    points, visible = start.copy(), np.zeros(count, bool)
    beside = [_borders(look, share, start)[1] for look, share in zip(looks, expected, strict=True)]
    for _ in range(ROUNDS):
        blocks = np.tile(np.eye(3) / STAY_SIGMA_M**2, (count, 1, 1))
        right = (start - points) / STAY_SIGMA_M**2
        out = points - centre
        far = np.linalg.norm(out, axis=1, keepdims=True)
        out /= far
        blocks += out[:, :, None] * out[:, None] / SURFACE_SIGMA_M**2
        right += out * (depth[:, None] - far) / SURFACE_SIGMA_M**2
        visible[:] = False
        for look, offset in zip(looks, beside, strict=True):
            direction, away = _borders(look, look.shares.ball, points)
            away = away - offset
            measured = asks & np.isfinite(away)
            miss = np.where(measured, np.nan_to_num(away), 0)
            weight = measured / (1 + (miss / SLIP_M) ** 2) / len(looks) / SEEN_SIGMA_M**2
            blocks += weight[:, None, None] * direction[:, :, None] * direction[:, None]
            right += (weight * miss)[:, None] * direction
            visible |= measured
        matrix = stiff.copy()
        for i in range(count):
            matrix[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += blocks[i]
        points = points + np.linalg.solve(matrix, right.ravel() - stiff @ (points - start).ravel()).reshape(count, 3)
    closed = np.concatenate([points, points[:1]])
    return points[: corner + 1], closed[corner:][::-1], float(visible[asks].mean())


def _borders(look: EyeLook, ball: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit directions [N, 3] out of the eye across the curve `points` [N, 3], and the ball's end along them.

    The latter, [N] in metres, by the ball's share [SIDE, SIDE] of the crop; nan where it does not end.
    """
    view, move = look.view, look.shares.move
    pixels, depth = view.project(points)
    at = pixels @ move[:, :2].T + move[:, 2]
    along = np.roll(at, -1, 0) - np.roll(at, 1, 0)
    normal = np.stack([along[:, 1], -along[:, 0]], 1)
    following = np.roll(at, -1, 0)
    if (at[:, 0] * following[:, 1] - following[:, 0] * at[:, 1]).sum() < 0:
        normal = -normal
    normal = unit(normal)
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
    ray = unit(points - view.centre)
    direction -= (direction * ray).sum(1, keepdims=True) * ray
    direction = unit(direction)
    return direction, np.where(np.isfinite(nearest), nearest * metres, np.nan)
