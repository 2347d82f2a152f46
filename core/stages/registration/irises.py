# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The disc within the iris' edge, in space: the one whose pictures are the irises that the eye reader sees in all
views, under what is known of eyes."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from ...face.lids import FORWARD, PosedEyeball
from .eye_looks import EyeLook

RADIUS_M, RADIUS_SIGMA = 0.0059, 0.06
"""Of people's irises (11.7 +- 0.5 mm across: Rufer et al. 2005), as a logarithm; as much again is what a capture's
scale is uncertain by."""
GAZE_SIGMA_RAD = 0.17
"""Radians by which eyes usually turn in the head: they look ahead, and some ten degrees around."""
CENTRE_SIGMA_M = np.array([0.0010, 0.0025, 0.0010])
"""How well the head around tells where an eyeball lies: between its corners, and as deep as people's eyes vary (by
Hertel's exophthalmometer, 2 to 2.5 mm)."""
INDEPENDENT_PIXELS, SHARE_SIGMA = 20, 0.3
"""Pixels of a view that count as independent, and how far off a share usually is."""
SOFT_PX = 0.35
"""Width of an edge in the crop, as a logistic function's."""


def fit_iris(looks: list[EyeLook], ball: PosedEyeball) -> tuple[np.ndarray, float, np.ndarray]:
    """The disc's middle [3] and its radius, metres, on an eyeball that lies about where `ball` does, and by how much
    that is to be moved [3]."""
    seen = [_rays(one) for one in looks]
    seen = [rays for rays in seen if len(rays[0])]
    start = np.concatenate([_first_gaze(seen, ball)[[0, 2]], np.zeros(4)])

    def placed(state: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """The disc's middle and axis, and its radius."""
        aside, up = np.clip(state[:2], -0.7, 0.7)
        gaze = np.array([aside, -np.sqrt(1 - aside**2 - up**2), up])
        radius = RADIUS_M * np.exp(state[2])
        return ball.centre + 1e-3 * state[3:] + np.sqrt(max(ball.radius**2 - radius**2, 0.0)) * gaze, gaze, radius

    def misses(state: np.ndarray) -> np.ndarray:
        middle, gaze, radius = placed(state)
        off = [state[:2] / GAZE_SIGMA_RAD, state[2:3] / RADIUS_SIGMA, 1e-3 * state[3:] / CENTRE_SIGMA_M]
        for origin, rays, share, ball_share, radians in seen:
            along = (middle - origin) @ gaze / (rays @ gaze)
            distance = np.linalg.norm(origin + along[:, None] * rays - middle, axis=1)
            inside = 1 / (1 + np.exp(np.clip((distance - radius) / (SOFT_PX * radians * along), -50, 50)))
            off.append((inside - share) * np.sqrt(ball_share * INDEPENDENT_PIXELS / len(rays)) / SHARE_SIGMA)
        return np.concatenate(off)

    solution = least_squares(misses, start, diff_step=1e-3).x
    middle, _, radius = placed(solution)
    return middle, float(radius), 1e-3 * solution[3:]


def _rays(look: EyeLook) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """Of the crop's pixels that show the ball: where their rays begin [3] and go [N, 3], the iris' share of the ball
    there and the ball's of the pixel [N]; how large a pixel is at the eye, in radians."""
    view, shares = look.view, look.shares
    y, x = np.nonzero(shares.ball > 0.5)
    turn = np.linalg.inv(shares.move[:, :2])
    pixels = (np.stack([x, y], 1) + 0.5 - shares.move[:, 2]) @ turn.T
    share = np.clip(shares.iris[y, x] / shares.ball[y, x], 0, 1)
    radians = np.sqrt(abs(np.linalg.det(turn))) / view.camera.mean_focal_length()
    return view.centre, view.rays(pixels), share, shares.ball[y, x], radians


def _first_gaze(sights: list[tuple], ball: PosedEyeball) -> np.ndarray:
    """The unit direction [3] from the ball's centre to the middle of what is seen of the iris, in the mean."""
    towards = [np.zeros(3)]
    for origin, rays, share, _, _ in sights:
        if share.sum() > 4:
            ray = share @ rays
            ray /= np.linalg.norm(ray)
            along = (ball.centre - origin) @ ray
            nearest = origin + along * ray - ball.centre
            depth = np.sqrt(max(ball.radius**2 - nearest @ nearest, 0.0))
            towards.append((nearest - depth * ray) / ball.radius)
    total = np.sum(towards, axis=0)
    length = np.linalg.norm(total)
    return total / length if length > 1e-6 else FORWARD
