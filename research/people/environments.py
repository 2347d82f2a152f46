# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Environments of a portrait as radiance from olat.DIRECTIONS: panoramas (HDRI), or made ones.

Made ones have sky, ground, walls, windows and lamps. A panorama's sun is taken out of it and handed on by itself, as
the lights of the stage are too few for its shadow's edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial import cKDTree

from core.imaging import images
from core.light.spherical_harmonics import LAMBERT, per_function, sh_basis

from .olat import BASIS, DIRECTIONS, LIGHTS

WIDTH = 128  # of a panorama kept for backgrounds
SUN_OVER_MEAN = 25.0  # radiance, in means of the panorama, over which a texel is a lamp or the sun


@dataclass(frozen=True)
class Environment:
    """Light from all directions.

    radiance float32 [LIGHTS, 3], linear, of mean luminance 1; colour [3] of the brightest light as irradiance over pi
    (zeros: none); panorama float32 [WIDTH / 2, WIDTH, 3]: the background.
    """

    radiance: np.ndarray
    colour: np.ndarray
    panorama: np.ndarray

    @property
    def sky(self) -> np.ndarray:
        """Coefficients [9, 3] of the radiance in spherical harmonics."""
        return BASIS.T @ self.radiance * (4 * np.pi / LIGHTS)


def irradiance(directions: np.ndarray, sky: np.ndarray) -> np.ndarray:
    """Return irradiance / pi [..., 3] on surfaces that face unit directions [..., 3]; float32."""
    return (sh_basis(directions) * np.float32(per_function(LAMBERT))) @ sky


def random_environment(panoramas: list[np.ndarray], rng: np.random.Generator) -> Environment:
    """Draw one of the panoramas in six cases of ten, a made environment in the others or without any."""
    if len(panoramas) and rng.random() < 0.6:
        return panorama_environment(panoramas[rng.integers(len(panoramas))], rng)
    return made_environment(rng)


def read_panoramas(folder: Path | None) -> list[np.ndarray]:
    """Read the equirectangular panoramas (.hdr, .exr) of a folder by name, linear [128, 256, 3].

    None without a folder.
    """
    paths = sorted(p for p in Path(folder).iterdir() if p.suffix.lower() in (".hdr", ".exr")) if folder else []
    return [np.maximum(images.resize(images.read_linear(path), 256, 128), 0) for path in paths]


def panorama_environment(panorama: np.ndarray, rng: np.random.Generator) -> Environment:
    """Return a panorama turned about the vertical at random; its middle column is ahead of the face (-Y)."""
    turned = np.roll(panorama, rng.integers(panorama.shape[1]), 1)
    if rng.random() < 0.5:
        turned = turned[:, ::-1]
    turned, _, colour = without_lamp(turned)
    small = cv2.resize(turned, (WIDTH, WIDTH // 2), interpolation=cv2.INTER_AREA)
    return _normalised(_gathered(turned), colour, small)


def without_lamp(panorama: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Remove from a panorama [H, W, 3] the light above SUN_OVER_MEAN.

    Returns the rest, the unit direction [3] of that light, and its colour [3] as irradiance over pi (zeros: none).
    """
    solid, directions = solid_angles(*panorama.shape[:2]), panorama_directions(*panorama.shape[:2])
    luminance = panorama.mean(-1)
    mean = (luminance * solid).sum() / solid.sum()
    hard = luminance > SUN_OVER_MEAN * mean
    if not hard.any():
        return panorama, np.array([0.0, -0.6, 0.8]), np.zeros(3)
    limit = SUN_OVER_MEAN * mean * panorama / np.maximum(luminance, 1e-6)[..., None]
    excess = np.where(hard[..., None], panorama - limit, 0)
    lamp = (directions * (excess.mean(-1) * solid)[..., None]).sum((0, 1))
    return panorama - excess, lamp / np.linalg.norm(lamp), (excess * solid[..., None]).sum((0, 1)) / np.pi


def made_environment(rng: np.random.Generator) -> Environment:
    """Make an environment of sky, ground, walls and windows of all colours, without a panorama."""
    directions = panorama_directions(WIDTH // 2, WIDTH)
    height = directions[..., 2]
    sky, ground = _colour(rng, 0.25) * np.exp(rng.normal(0, 0.6)), _colour(rng, 0.4) * np.exp(rng.normal(-0.9, 0.7))
    edge = np.clip(0.5 + height / rng.uniform(0.05, 0.5), 0, 1)[..., None]
    panorama = sky * edge * (1 + rng.uniform(-0.4, 0.8) * np.maximum(height, 0))[..., None] + ground * (1 - edge)
    for _ in range(rng.integers(0, 7)):
        towards = rng.normal(size=3) * [1, 1, 0.5] + [0, 0, 0.15]
        near = directions @ (towards / np.linalg.norm(towards))
        size = np.exp(rng.uniform(np.log(0.15), np.log(1.2)))
        share = np.clip(0.5 + (near - np.cos(size)) / rng.uniform(0.02, 0.4), 0, 1)[..., None]
        strength = np.exp(rng.normal(0.2, 1.1) - 0.5 * np.log(size))
        panorama = panorama * (1 - share) + share * _colour(rng, 0.35) * strength
    return _normalised(_gathered(panorama), np.zeros(3), panorama)


def background_radiance(environment: Environment, directions: np.ndarray) -> np.ndarray:
    """Return the background's radiance [..., 3] in unit directions [..., 3]."""
    height, width = environment.panorama.shape[:2]
    column = (0.5 + np.arctan2(directions[..., 0], -directions[..., 1]) / (2 * np.pi)) * width
    row = np.arccos(np.clip(directions[..., 2], -1, 1)) / np.pi * height
    column, row = (column - 0.5).astype(np.float32), (row - 0.5).astype(np.float32)
    panorama = environment.panorama.astype(np.float32)
    return cv2.remap(panorama, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


def _normalised(radiance: np.ndarray, colour: np.ndarray, panorama: np.ndarray) -> Environment:
    mean = max(float(radiance.mean()), 1e-6)
    return Environment(*((light / mean).astype(np.float32) for light in (radiance, colour, panorama)))


def _gathered(panorama: np.ndarray) -> np.ndarray:
    """Return the mean radiance [LIGHTS, 3] of the part of a panorama that is nearest to each light."""
    height, width = panorama.shape[:2]
    if height > WIDTH // 2:
        height, width = WIDTH // 2, WIDTH
        panorama = cv2.resize(panorama, (width, height), interpolation=cv2.INTER_AREA)
    solid = solid_angles(height, width).ravel()
    weight = np.bincount(_NEAREST, solid, len(DIRECTIONS))
    sums = [np.bincount(_NEAREST, solid * panorama[..., k].ravel(), len(DIRECTIONS)) for k in range(3)]
    return np.stack(sums, -1) / weight[:, None]


def panorama_directions(height: int, width: int) -> np.ndarray:
    """Return unit directions [H, W, 3] of an equirectangular panorama's texels."""
    polar = (np.arange(height) + 0.5)[:, None] / height * np.pi
    azimuth = ((np.arange(width) + 0.5)[None] / width - 0.5) * 2 * np.pi
    return np.stack(
        [np.sin(polar) * np.sin(azimuth), -np.sin(polar) * np.cos(azimuth), np.cos(polar) * np.ones_like(azimuth)], -1
    )


def solid_angles(height: int, width: int) -> np.ndarray:
    """Return steradians [H, W] of an equirectangular panorama's texels."""
    polar = (np.arange(height) + 0.5)[:, None] / height * np.pi
    return np.broadcast_to(np.sin(polar) * (np.pi / height) * (2 * np.pi / width), (height, width))


def _colour(rng: np.random.Generator, spread: float) -> np.ndarray:
    """Draw a light's colour [3] of mean about 1: warm or cool, a little green or magenta."""
    warm, green = rng.normal(0, spread), rng.normal(0, 0.25 * spread)
    return np.exp([0.6 * warm, green, -warm])


_NEAREST = cKDTree(DIRECTIONS).query(panorama_directions(WIDTH // 2, WIDTH).reshape(-1, 3))[1]
