# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the edges of open lids and the irises lie in the world: the edges and the disc that fit what the eye reader saw
in all frames at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..contract.messages import Reporter
from ..face import lids
from ..face.eye_reader import SIDE
from ..geometry import raster
from ..geometry.meshes import joined
from .eye_looks import EyeLook
from .irises import fit_iris
from .lid_edges import fit_edges

MARKS = 9
"""On each edge, from corner to corner."""
LEAST_TOLD = 0.5
"""Share of the edges' points that a view must tell of."""
OVER = 2
"""Rays along the side of a pixel of the crop."""


@dataclass(frozen=True)
class LidMarks:
    """Of one eye, metres: upper and lower edge of the lids [MARKS, 3], from the outer corner to the inner one, the ends
    shared; iris [3]: the middle of the disc within the iris' edge, and its radius; views: how many told of them."""

    upper: np.ndarray
    lower: np.ndarray
    iris: np.ndarray
    iris_radius: float
    views: int

    @property
    def width(self) -> float:
        """Distance of the eye's corners."""
        return float(np.linalg.norm(self.upper[0] - self.upper[-1]))


def mark(looks: list[EyeLook], opened: lids.OpenHead, side: int, report: Reporter) -> LidMarks | None:
    """The marks of the left (0) or the right eye that fit what was seen of it, beginning with a head whose lids are
    open about as wide; None where nothing was seen."""
    if not looks:
        return None
    ball = opened.balls[side]
    iris, radius, shift = fit_iris(looks, ball)
    caster = raster.RayCaster(joined([part.moved(part.vertices + shift) for part in (opened.skin, ball.mesh)]))
    expected = []
    for one in looks:
        report.check()
        expected.append(_expected(one, caster, len(opened.skin.faces)))
    begun = (edge + shift for edge in lids.edges(opened.skin.vertices, side))
    upper, lower, told = fit_edges(looks, expected, *begun, ball.centre + shift)
    if told < LEAST_TOLD:
        return None
    return LidMarks(_spread(upper), _spread(lower), iris, radius, len(looks))


def _expected(one: EyeLook, caster: raster.RayCaster, first: int) -> np.ndarray:
    """The ball's share [SIDE, SIDE] of the crop's pixels, of a head whose faces from `first` on are the ball."""
    y, x = (np.mgrid[0:SIDE * OVER, 0:SIDE * OVER] + 0.5) / OVER
    pixels = (np.stack([x.ravel(), y.ravel()], 1) - one.shares.move[:, 2]) @ np.linalg.inv(one.shares.move[:, :2]).T
    rays = one.view.rays(pixels)
    face, _, _ = caster.first_hits(np.repeat(one.view.centre[None], len(rays), 0), rays)
    return (face >= first).reshape(SIDE, OVER, SIDE, OVER).mean((1, 3), dtype=np.float32)


def _spread(edge: np.ndarray) -> np.ndarray:
    """MARKS points, evenly spread along an edge [N, 3]."""
    along = np.append(0, np.cumsum(np.linalg.norm(np.diff(edge, axis=0), axis=1)))
    at = np.linspace(0, along[-1], MARKS)
    return np.stack([np.interp(at, along, edge[:, axis]) for axis in range(3)], 1)
