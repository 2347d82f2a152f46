# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture on an eyeball: white with vessels, iris with fibres and a darker rim, pupil.

Rings about the middle, as lids.PosedEyeball says.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

IRIS_MM = 5.9  # radius of an adult's iris
WHITE = np.array([0.50, 0.43, 0.39])  # linear albedo
VESSELS = np.array([0.55, 0.20, 0.15])


def paint_eyes(iris: np.ndarray, ball_radius: float, seed: int, size: int = 512) -> np.ndarray:
    """Return the linear albedo of both eyes in the eyeball's UVs, float32 [size, size, 3].

    iris [3]: its linear albedo; ball_radius in metres.
    """
    rng = np.random.default_rng([seed, 64])
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size - 0.5
    angle = np.pi * (2 * np.hypot(x, y)).clip(0, 1) ** (1 / 0.6)
    turn = np.arctan2(y, x)
    rim = np.arcsin(IRIS_MM / (1000 * ball_radius))
    pupil = rim * rng.uniform(0.36, 0.52)
    inward = np.clip((angle - pupil) / (rim - pupil), 0, 1)  # 0 at the pupil ... 1 at the rim
    fibres = sum(
        np.interp(turn, np.linspace(-np.pi, np.pi, n), np.append(v := rng.normal(size=n - 1), v[0]))
        for n in (60, 140, 260)
    ) / np.sqrt(3)
    rough = gaussian_filter(rng.normal(size=(size, size)), 3) * 8
    light = np.exp(0.22 * fibres * (1 - 0.5 * inward) + 0.10 * rough)
    light = light * (1 + 0.35 * np.exp(-(((inward - 0.25) / 0.15) ** 2)))
    coloured = np.asarray(iris) * (light * (1 - 0.65 * _step(inward, 0.93, 0.10)))[..., None]
    coloured = coloured * (1 - 0.97 * (1 - _step(angle, pupil, 0.025)))[..., None] + 0.002
    vessel = np.clip(gaussian_filter(rng.normal(size=(size, size)), 1.2) * 4 - 0.9, 0, 1)
    vessel = vessel * np.clip((angle - 1.25 * rim) / rim, 0, 1)
    yellow = 1 - np.array([0.02, 0.06, 0.14]) * rng.random() * np.clip((angle - rim) / rim, 0, 1)[..., None]
    white = WHITE * np.exp(rng.normal(0, 0.05)) * yellow * (1 - 0.35 * vessel[..., None])
    white = white + 0.35 * vessel[..., None] * VESSELS
    outside = _step(angle, rim, 0.05)[..., None]
    return (coloured * (1 - outside) + white * outside).astype(np.float32)


def _step(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return a smooth step from 0 to 1 about `at`."""
    t = np.clip((x - at) / width + 0.5, 0, 1)
    return t * t * (3 - 2 * t)
