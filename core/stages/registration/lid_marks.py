# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Edges of open lids and irises in the world that fit the eye reader's result in all frames at once."""

from dataclasses import dataclass, replace

import numpy as np

from ...capture.messages import Reporter
from ...face import lids
from ...face.eye_reader import SIDE_PX
from ...face.parts import to_picture
from ...geometry import raster
from ...geometry.meshes import joined
from .eye_looks import EyeLook
from .irises import fit_iris
from .lid_edges import SEEN_SIGMA_M, fit_edges

MARKS_PER_EDGE = 9  # marks on each edge, from corner to corner
LEAST_VISIBLE_SHARE = 0.5  # minimum share of the edges' points that a view must show
RAYS_PER_SIDE = 2  # rays along the side of a pixel of the crop
LEAST_BALL_PX = 30  # minimum pixels of the crop that a ball must cover to locate its middle
OFFSET_SIGMA_M = np.array([0.004, 0.001, 0.004])
"""Deviation of a fitted head's eyes from the true ones, at most: sideways and in depth."""
SLIP_M, ROUNDS = 0.0015, 8  # miss of one view that counts a quarter


@dataclass(frozen=True)
class LidMarks:
    """Marks of one eye, metres.

    Upper and lower edge of the lids [MARKS_PER_EDGE, 3], from the outer corner to the inner one, the ends shared; iris
    [3]: the middle of the disc within the iris' edge, and its radius; views: their number.
    """

    upper: np.ndarray
    lower: np.ndarray
    iris: np.ndarray
    iris_radius: float
    views: int


def mark(looks: list[EyeLook], opened: lids.OpenHead, side: int, report: Reporter) -> LidMarks | None:
    """Mark the lids and the iris of the left (0) or right (1) eye; None where no view shows it.

    opened is a head whose lids are open about as wide, where the fit begins.
    """
    if not looks:
        return None
    ball = opened.balls[side]
    offset = _offset(looks, _all_expected(looks, opened, side, np.zeros(3), report), ball.centre)
    iris, radius, shift = fit_iris(looks, replace(ball, centre=ball.centre + offset))
    shift = offset + shift * [0, 1, 0]  # across the face the iris depends on the gaze as well
    edges = (edge + shift for edge in lids.edges(opened.skin.vertices, side))
    expected = _all_expected(looks, opened, side, shift, report)
    upper, lower, visible_share = fit_edges(looks, expected, *edges, ball.centre + shift)
    if visible_share < LEAST_VISIBLE_SHARE:
        return None
    return LidMarks(_spread(upper), _spread(lower), iris, radius, len(looks))


def _all_expected(
    looks: list[EyeLook], opened: lids.OpenHead, side: int, shift: np.ndarray, report: Reporter
) -> list[np.ndarray]:
    """Return for each look the ball's share [SIDE, SIDE] of the crop's pixels on a head shifted by [3]."""
    parts = [mesh.moved(mesh.vertices + shift) for mesh in (opened.skin, opened.balls[side].mesh)]
    caster, first = raster.RayCaster(joined(parts)), len(opened.skin.faces)
    y, x = (np.mgrid[0 : SIDE_PX * RAYS_PER_SIDE, 0 : SIDE_PX * RAYS_PER_SIDE] + 0.5) / RAYS_PER_SIDE
    expected = []
    for look in looks:
        report.check()
        rays = look.view.rays(to_picture(np.stack([x.ravel(), y.ravel()], 1), look.shares.move))
        face, _, _ = caster.first_hits(np.repeat(look.view.centre[None], len(rays), 0), rays)
        expected.append(
            (face >= first).reshape(SIDE_PX, RAYS_PER_SIDE, SIDE_PX, RAYS_PER_SIDE).mean((1, 3), dtype=np.float32)
        )
    return expected


def _offset(looks: list[EyeLook], expected: list[np.ndarray], centre: np.ndarray) -> np.ndarray:
    """Return the offset [3] in metres of an eyeball expected at `centre` [3], by the middles of what is seen of it.

    An edge shows little of a shift along it, and a head's lids may lie millimetres beside.
    """
    y, x = np.mgrid[0:SIDE_PX, 0:SIDE_PX] + 0.5
    axes, misses = [], []
    for look, share in zip(looks, expected, strict=True):
        ball = look.shares.ball
        if min(ball.sum(), share.sum()) < LEAST_BALL_PX:
            continue
        middles = np.array([[(mask * x).sum() / mask.sum(), (mask * y).sum() / mask.sum()] for mask in (share, ball)])
        rays = look.view.rays(to_picture(middles, look.shares.move))
        axes.append(look.view.rotation[:2])
        misses.append(axes[-1] @ (rays[1] - rays[0]) * np.linalg.norm(centre - look.view.centre))
    offset = np.zeros(3)
    for _ in range(ROUNDS if axes else 0):
        residuals = np.array(misses) - np.array(axes) @ offset
        weight = 1 / (1 + (residuals**2).sum(1) / SLIP_M**2) ** 2 / (len(axes) * SEEN_SIGMA_M**2)
        matrix = np.einsum("v,vij,vik->jk", weight, axes, axes) + np.diag(1 / OFFSET_SIGMA_M**2)
        offset = np.linalg.solve(matrix, np.einsum("v,vij,vi->j", weight, axes, misses))
    return offset


def _spread(edge: np.ndarray) -> np.ndarray:
    """Return MARKS_PER_EDGE points, evenly spread along an edge [N, 3]."""
    along = np.append(0, np.cumsum(np.linalg.norm(np.diff(edge, axis=0), axis=1)))
    at = np.linspace(0, along[-1], MARKS_PER_EDGE)
    return np.stack([np.interp(at, along, edge[:, axis]) for axis in range(3)], 1)
