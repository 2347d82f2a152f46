# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the edges of open lids and the irises lie in the world: the edges and the disc that fit what the eye reader saw
in all frames at once."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...capture.messages import Reporter
from ...face import lids
from ...face.eye_reader import SIDE_PX
from ...geometry import raster
from ...geometry.meshes import joined
from .eye_looks import EyeLook
from .irises import fit_iris
from .lid_edges import SEEN_SIGMA_M, fit_edges

MARKS_PER_EDGE = 9
"""On each edge, from corner to corner."""
LEAST_TOLD_SHARE = 0.5
"""Share of the edges' points that a view must tell of."""
RAYS_PER_SIDE = 2
"""Rays along the side of a pixel of the crop."""
LEAST_SEEN_PX = 30
"""Pixels of the crop that a ball must cover for its middle to be told."""
OFFSET_SIGMA_M = np.array([0.004, 0.001, 0.004])
"""How far a fitted head's eyes lie beside the true ones, at most, and before or behind them."""
SLIP_M, ROUNDS = 0.0015, 8
"""A miss of one view that counts a quarter."""


@dataclass(frozen=True)
class LidMarks:
    """Of one eye, metres: upper and lower edge of the lids [MARKS_PER_EDGE, 3], from the outer corner to the inner one,
    the ends shared; iris [3]: the middle of the disc within the iris' edge, and its radius; views: how many told of
    them."""

    upper: np.ndarray
    lower: np.ndarray
    iris: np.ndarray
    iris_radius: float
    views: int


def mark(looks: list[EyeLook], opened: lids.OpenHead, side: int, report: Reporter) -> LidMarks | None:
    """The marks of an eye's lids and iris that fit what was seen of it.

    Parameters
    ----------
    looks : at this eye
    opened : a head whose lids are open about as wide, where the fit begins
    side : 0 for the left eye, 1 for the right
    report : hears whether it is cancelled

    Returns
    -------
    None where nothing was seen.
    """
    if not looks:
        return None
    ball = opened.balls[side]
    off = _offset(looks, _all_expected(looks, opened, side, np.zeros(3), report), ball.centre)
    iris, radius, shift = fit_iris(looks, replace(ball, centre=ball.centre + off))
    shift = off + shift * [0, 1, 0]  # across the face the iris tells of the gaze as well
    begun = (edge + shift for edge in lids.edges(opened.skin.vertices, side))
    expected = _all_expected(looks, opened, side, shift, report)
    upper, lower, told = fit_edges(looks, expected, *begun, ball.centre + shift)
    if told < LEAST_TOLD_SHARE:
        return None
    return LidMarks(_spread(upper), _spread(lower), iris, radius, len(looks))


def _all_expected(
    looks: list[EyeLook], opened: lids.OpenHead, side: int, shift: np.ndarray, report: Reporter
) -> list[np.ndarray]:
    """For each look the ball's share [SIDE, SIDE] of the crop's pixels as a head shows it that is moved by `shift`
    [3]."""
    parts = [mesh.moved(mesh.vertices + shift) for mesh in (opened.skin, opened.balls[side].mesh)]
    caster, first = raster.RayCaster(joined(parts)), len(opened.skin.faces)
    y, x = (np.mgrid[0 : SIDE_PX * RAYS_PER_SIDE, 0 : SIDE_PX * RAYS_PER_SIDE] + 0.5) / RAYS_PER_SIDE
    expected = []
    for one in looks:
        report.check()
        move = one.shares.move
        rays = one.view.rays((np.stack([x.ravel(), y.ravel()], 1) - move[:, 2]) @ np.linalg.inv(move[:, :2]).T)
        face, _, _ = caster.first_hits(np.repeat(one.view.centre[None], len(rays), 0), rays)
        expected.append(
            (face >= first).reshape(SIDE_PX, RAYS_PER_SIDE, SIDE_PX, RAYS_PER_SIDE).mean((1, 3), dtype=np.float32)
        )
    return expected


def _offset(looks: list[EyeLook], expected: list[np.ndarray], centre: np.ndarray) -> np.ndarray:
    """How far an eyeball expected at `centre` [3] lies from there [3], metres, by the middles of what is seen of it: an
    edge tells little of a shift along it, and a head's lids may lie millimetres beside."""
    y, x = np.mgrid[0:SIDE_PX, 0:SIDE_PX] + 0.5
    axes, misses = [], []
    for one, share in zip(looks, expected, strict=True):
        seen, move = one.shares.ball, one.shares.move
        if min(seen.sum(), share.sum()) < LEAST_SEEN_PX:
            continue
        middles = np.array([[(mask * x).sum() / mask.sum(), (mask * y).sum() / mask.sum()] for mask in (share, seen)])
        rays = one.view.rays((middles - move[:, 2]) @ np.linalg.inv(move[:, :2]).T)
        axes.append(one.view.rotation[:2])
        misses.append(axes[-1] @ (rays[1] - rays[0]) * np.linalg.norm(centre - one.view.centre))
    off = np.zeros(3)
    for _ in range(ROUNDS if axes else 0):
        left = np.array(misses) - np.array(axes) @ off
        weight = 1 / (1 + (left**2).sum(1) / SLIP_M**2) ** 2 / (len(axes) * SEEN_SIGMA_M**2)
        matrix = np.einsum("v,vij,vik->jk", weight, axes, axes) + np.diag(1 / OFFSET_SIGMA_M**2)
        off = np.linalg.solve(matrix, np.einsum("v,vij,vi->j", weight, axes, misses))
    return off


def _spread(edge: np.ndarray) -> np.ndarray:
    """MARKS_PER_EDGE points, evenly spread along an edge [N, 3]."""
    along = np.append(0, np.cumsum(np.linalg.norm(np.diff(edge, axis=0), axis=1)))
    at = np.linspace(0, along[-1], MARKS_PER_EDGE)
    return np.stack([np.interp(at, along, edge[:, axis]) for axis in range(3)], 1)
