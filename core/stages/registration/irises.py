# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Disc within the iris' edge, in space, whose pictures are the irises that the eye reader sees in all views."""

import numpy as np
from scipy.optimize import least_squares

from ...face.lids import FORWARD, PosedEyeball
from .eye_looks import EyeLook

RADIUS_M, RADIUS_SIGMA = 0.0059, 0.06
"""Radius of people's irises (11.7 +- 0.5 mm across: Rufer et al. 2005) and the deviation of its log, which includes as
much again for a capture's uncertain scale."""
GAZE_SIGMA_RAD = 0.17  # usual turn of eyes in the head, in radians: straight ahead and some ten degrees around
CENTRE_SIGMA_M = np.array([0.0010, 0.0025, 0.0010])
"""Deviation of an eyeball's centre from the head's around it: between its corners, and as deep as people's eyes vary
(by Hertel's exophthalmometer, 2 to 2.5 mm)."""
INDEPENDENT_PIXELS, SHARE_SIGMA = 20, 0.3  # pixels of a view that count as independent, and usual deviation of a share
SOFT_PX = 0.35  # width of an edge in the crop, as a logistic function's


def fit_iris(looks: list[EyeLook], ball: PosedEyeball) -> tuple[np.ndarray, float, np.ndarray]:
    """Fit the disc's middle [3] and radius, metres, and the shift [3] of the eyeball, which lies near `ball`."""
    rays_of_views = [_rays(look) for look in looks]
    rays_of_views = [rays for rays in rays_of_views if len(rays[0])]
    start = np.concatenate([_first_gaze(rays_of_views, ball)[[0, 2]], np.zeros(4)])

    def placed(state: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        aside, up = np.clip(state[:2], -0.7, 0.7)
        gaze = np.array([aside, -np.sqrt(1 - aside**2 - up**2), up])
        radius = RADIUS_M * np.exp(state[2])
        return ball.centre + 1e-3 * state[3:] + np.sqrt(max(ball.radius**2 - radius**2, 0.0)) * gaze, gaze, radius

    def misses(state: np.ndarray) -> np.ndarray:
        middle, gaze, radius = placed(state)
        residuals = [state[:2] / GAZE_SIGMA_RAD, state[2:3] / RADIUS_SIGMA, 1e-3 * state[3:] / CENTRE_SIGMA_M]
        for origin, rays, share, ball_share, radians in rays_of_views:
            along = (middle - origin) @ gaze / (rays @ gaze)
            distance = np.linalg.norm(origin + along[:, None] * rays - middle, axis=1)
            inside = 1 / (1 + np.exp(np.clip((distance - radius) / (SOFT_PX * radians * along), -50, 50)))
            residuals.append((inside - share) * np.sqrt(ball_share * INDEPENDENT_PIXELS / len(rays)) / SHARE_SIGMA)
        return np.concatenate(residuals)

    solution = least_squares(misses, start, diff_step=1e-3).x
    middle, _, radius = placed(solution)
    return middle, float(radius), 1e-3 * solution[3:]


def _rays(look: EyeLook) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """Return the rays of the crop's pixels that show the ball.

    Their origin [3] and directions [N, 3], the iris' share of the ball there and the ball's of the pixel [N], and the
    size of a pixel in radians.
    """
    view, shares = look.view, look.shares
    y, x = np.nonzero(shares.ball > 0.5)
    turn = np.linalg.inv(shares.move[:, :2])
    pixels = (np.stack([x, y], 1) + 0.5 - shares.move[:, 2]) @ turn.T
    share = np.clip(shares.iris[y, x] / shares.ball[y, x], 0, 1)
    radians = np.sqrt(abs(np.linalg.det(turn))) / view.camera.mean_focal_length()
    return view.centre, view.rays(pixels), share, shares.ball[y, x], radians


def _first_gaze(sights: list[tuple], ball: PosedEyeball) -> np.ndarray:
    """Return the mean unit direction [3] from the ball's centre to the middle of the visible iris."""
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
