# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the edges of open lids and the irises lie in the world: the eye network's marks in the frames that see an eye
well, lifted to points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..face.faces import Eye, shows_eye
from ..geometry.views import View

LEAST_VIEWS, LEAST_DEG = 2, 8.0
"""So many views, so far apart, lift a mark."""
ROUNDS = 10
ROBUST_PX = 1.0
"""Error of a mark that counts half, at least: the network's marks are not finer."""


@dataclass(frozen=True)
class LidMarks:
    """Of one eye, metres: upper and lower edge of the lids [9, 3], from the outer corner to the inner one, the ends
    shared; centre of the iris [3] and its radius; views: how many it was lifted from."""

    upper: np.ndarray
    lower: np.ndarray
    iris: np.ndarray
    iris_radius: float
    views: int

    @property
    def width(self) -> float:
        """Distance of the eye's corners."""
        return float(np.linalg.norm(self.upper[0] - self.upper[-1]))


def usable(seen: list[tuple[float, Eye]], side: int) -> list[int]:
    """Which sights (yaw of the head in degrees, eye) of the left (0) or right (1) eye hold: it is not beyond the nose,
    and as open as it usually is."""
    there = [i for i, (yaw, _) in enumerate(seen) if shows_eye(yaw, side)]
    usual = float(np.median([seen[i][1].opening for i in there])) if there else 0.0
    return [i for i in there if seen[i][1].is_open_as(usual)]


def lift(views: list[View], eyes: list[Eye]) -> LidMarks | None:
    """The rims of one eye from its marks in several views; None where these are too few or too near to each other."""
    if len(views) < LEAST_VIEWS:
        return None
    pixels = np.stack([np.concatenate([eye.upper, eye.lower[1:-1], eye.iris[None]]) for eye in eyes])  # [V, 17, 2]
    origins = np.stack([view.centre for view in views])
    rays = np.stack([view.rays(marks) for view, marks in zip(views, pixels, strict=True)], 1)  # [17, V, 3]
    middle = rays.mean(0) / np.linalg.norm(rays.mean(0), axis=1, keepdims=True)
    if np.degrees(np.arccos(np.clip(middle @ middle.T, -1, 1))).max() < LEAST_DEG:
        return None
    across = np.eye(3) - rays[..., :, None] * rays[..., None, :]
    weights = np.ones(rays.shape[:2])
    for _ in range(ROUNDS):
        weighted = across * weights[..., None, None]
        points = np.linalg.solve(weighted.sum(1), np.einsum("nvij,vj->ni", weighted, origins)[..., None])[..., 0]
        seen = [view.project(points) for view in views]
        errors = np.stack([np.linalg.norm(xy - marks, axis=1) for (xy, _), marks in zip(seen, pixels, strict=True)], 1)
        depth = np.stack([z for _, z in seen], 1)
        if not np.isfinite(errors).all():
            return None
        width = max(ROBUST_PX, float(np.median(errors)))
        weights = (width**2 / (width**2 + errors**2)) / depth**2
    upper, lower = points[:9], points[[0, *range(9, 16), 8]]
    radii = [eye.iris_radius * z / view.camera.mean_focal_length()
             for view, eye, z in zip(views, eyes, depth[16], strict=True)]
    return LidMarks(upper, lower, points[16], float(np.median(radii)), len(views))
