# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surroundings of a subject: a hand-held camera path, a sun behind leaves, a cluttered room without walls.

World: metres, +Z up, the head's middle at the origin, its face towards -Y. The same numbers make the rendered video and
its truth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from core.geometry.meshes import Mesh

WIDTH, HEIGHT, FOCAL, RATE = 720, 960, 933.0, 24  # pixels, pixels, pixels, frames per second
DISTANCE = 0.46  # metres from the camera to the head's middle


@dataclass(frozen=True)
class Sun:
    """A sun: unit direction to it, irradiance across the beam in W/m^2, diameter in radians, linear sRGB colour."""

    direction: np.ndarray
    strength: float = 4.2
    angle: float = 0.006
    colour: tuple[float, float, float] = (1.0, 0.93, 0.82)


SKY = (0.42, 0.55, 0.80)
"""Radiance of the sky, linear sRGB."""


@dataclass(frozen=True)
class AreaLamp:
    """A square lamp that shines at the head: position [3] and side in metres, power in watts, linear sRGB colour."""

    position: tuple[float, float, float]
    size: float
    power: float
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class SceneLight:
    """All light on a subject.

    sky: its radiance everywhere, [3], or an equirectangular panorama [H, W, 3] as Blender reads one (its middle column
    is +X); blockers of the light, unseen by the camera; flash: watts of a small lamp at the camera, which goes with it.
    """

    sky: tuple[float, float, float] | np.ndarray = SKY
    sun: Sun | None = None
    blockers: Mesh | None = None
    lamps: tuple[AreaLamp, ...] = ()
    flash: float = 0.0


@dataclass(frozen=True)
class Shot:
    """The rendered part of a scene, and its quality.

    cameras [N, 4, 4]: camera to world; frames: numbers into them; samples of Cycles per pixel; scale of the pictures'
    size; poses [N, 4, 4]: head to world in each frame, None: still; room: True for a room behind the person; focal:
    factor on the focal length, for close-ups.
    """

    cameras: np.ndarray
    frames: Sequence[int]
    samples: int
    scale: float = 1.0
    poses: np.ndarray | None = None
    room: bool = True
    focal: float = 1.0


def sun_of(seed: int) -> Sun:
    """Draw a sun high and to one side, in front of the face."""
    rng = np.random.default_rng([seed, 20])
    azimuth, height = np.radians(rng.uniform(20, 50)) * rng.choice([-1, 1]), np.radians(rng.uniform(38, 52))
    return Sun(np.array([np.sin(azimuth) * np.cos(height), -np.cos(azimuth) * np.cos(height), np.sin(height)]))


def strew_leaves(seed: int, sun: Sun) -> Mesh:
    """Strew a loose twig between head and sun: pointed leaves 2.4 to 5.6 cm long over a disc across the beam.

    At 0.4 m from the head the sun blurs the edges over 2 mm: hard shadows, as at noon under a tree.
    """
    rng = np.random.default_rng([seed, 21])
    side = np.cross(sun.direction, [0, 0, 1.0])
    side /= np.linalg.norm(side)
    up = np.cross(side, sun.direction)
    vertices, faces = [], []
    for _ in range(28):
        a, r = rng.uniform(0, 2 * np.pi), 0.15 * np.sqrt(rng.uniform())
        centre = sun.direction * (0.40 + rng.uniform(-0.06, 0.06)) + side * r * np.cos(a) + up * r * np.sin(a)
        turn, length, width = rng.uniform(0, 2 * np.pi), rng.uniform(0.012, 0.028), rng.uniform(0.004, 0.010)
        along, over = side * np.cos(turn) + up * np.sin(turn), up * np.cos(turn) - side * np.sin(turn)
        over = over + sun.direction * rng.uniform(-0.6, 0.6)
        outline = [(-1, 0), (-0.4, -0.9), (0.3, -0.8), (1, 0), (0.3, 0.8), (-0.4, 0.9)]
        first = len(vertices)
        vertices += [centre + along * length * x + over * width * y for x, y in outline]
        faces += [(first, first + k, first + k + 1) for k in range(1, 5)]
    return Mesh(np.array(vertices), np.array(faces))


def camera_path(seed: int, frames: int) -> np.ndarray:
    """Return camera-to-world matrices [frames, 4, 4] of a hand-held pass (the camera looks along its -z, y up).

    Past the nose from 46 degrees at one side to as many at the other, up and down on the way, with the slow drift and
    the tremble of a hand.
    """
    rng = np.random.default_rng([seed, 22])
    t = np.linspace(0, 1, frames)
    azimuth = np.radians(46) * (0.8 * (2 * t - 1) + 0.2 * np.sin(np.pi * (t - 0.5))) * rng.choice([-1, 1])
    height = np.radians(7 + 13 * np.sin(2 * np.pi * (1.5 * t + 0.1)))
    distance = DISTANCE * (1 + 0.05 * np.sin(2 * np.pi * (1.2 * t + rng.uniform())))
    direction = np.stack([np.sin(azimuth) * np.cos(height), -np.cos(azimuth) * np.cos(height), np.sin(height)], -1)
    position = distance[:, None] * direction
    position += _drift(rng, frames, 0.008, 9) + _drift(rng, frames, 0.0015, 2)
    target = np.array([0, -0.01, -0.035]) + _drift(rng, frames, 0.010, 9) + _drift(rng, frames, 0.0015, 2)
    return looking(position, target, _drift(rng, frames, np.radians(1.5), 9)[:, 0])


def rig() -> np.ndarray:
    """Return the camera-to-world matrices [16, 4, 4] of a studio.

    Two fixed rows of eight cameras, over 100 degrees from side to side, as in multi-view face datasets.
    """
    height, azimuth = (np.radians(a).ravel() for a in np.meshgrid([-6.0, 22.0], np.linspace(-50, 50, 8), indexing="ij"))
    direction = np.stack([np.sin(azimuth) * np.cos(height), -np.cos(azimuth) * np.cos(height), np.sin(height)], -1)
    position = DISTANCE * direction
    return looking(position, np.broadcast_to([0, -0.01, -0.035], position.shape), np.zeros(len(position)))


def looking(position: np.ndarray, target: np.ndarray, roll: np.ndarray) -> np.ndarray:
    """Return camera-to-world matrices [N, 4, 4] of cameras at `position` [N, 3] that look at `target` [N, 3].

    They are turned about their axis by `roll` [N] radians.
    """
    back = position - target
    back /= np.linalg.norm(back, axis=1, keepdims=True)
    right = np.cross([0, 0, 1.0], back)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    up = np.cross(back, right)
    c, s = np.cos(roll)[:, None], np.sin(roll)[:, None]
    matrices = np.tile(np.eye(4), (len(position), 1, 1))
    matrices[:, :3, 0], matrices[:, :3, 1] = c * right + s * up, c * up - s * right
    matrices[:, :3, 2], matrices[:, :3, 3] = back, position
    return matrices


def _drift(rng: np.random.Generator, frames: int, size: float, period: float) -> np.ndarray:
    """Draw smooth motion [frames, 3] of deviation `size`, correlated over `period` frames."""
    noise = gaussian_filter1d(rng.normal(size=(frames + 40, 3)), period, axis=0)[20:-20]
    return size * noise / noise.std()
