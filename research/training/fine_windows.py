# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Training data of the upscaler: windows of synthetic skins at 4096, and a solver's 1024 map of the same place.

Only the windows are painted, never a whole 4096 map: a skin is a function of points on the head.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import torch

from core.capture.files import replacing
from core.capture.messages import Reporter
from core.face import template
from core.geometry import raster
from core.imaging import images

from ..people.canvas import canvas, make_window_canvas
from ..people.parameters import adorned, sample_parameters
from ..people.skin import GROUND, paint_skin
from .sights import run_jobs, stack_examples

SIZE = 4096
SIDE, MARGIN = 1024, 96
"""Texels of a painted window, and its border that is cut off: a hair whose root is outside is laid onto it. Scars, laid
over any distance, are left out."""
FACTOR, CHANNELS = 4, 7


class WindowBatch(NamedTuple):
    """small [N, 7, P, P] and large [N, 7, 4 P, 4 P], float32 in the network's channels."""

    small: torch.Tensor
    large: torch.Tensor


@dataclass(frozen=True)
class Degradation:
    """Losses of the solver's maps beside size.

    blur, other_blur: sigma in texels of the small map, of the diffuse and of the other channels; noise: deviation (sRGB
    of the diffuse; the others take twice as much); relief: the share of their fine relief that normals keep.
    """

    blur: float
    other_blur: float
    noise: float
    relief: float


def prepare(seeds: list[int], views: int, work: Path, report: Reporter, processes: int) -> None:
    """Paint the missing ones of `views` windows of each skin (some seconds each)."""
    missing = [(seed, i) for seed in seeds for i in range(views) if not _path(work, seed, i).is_file()]
    run_jobs(partial(_paint, work), missing, "window", report, processes)


class FineWindows:
    """Draws batches from prepared windows."""

    def __init__(self, seeds: list[int], views: int, work: Path):
        self.paths = [_path(work, seed, i) for seed in seeds for i in range(views)]

    def draw(self, count: int, patch: int, rng: np.random.Generator) -> WindowBatch:
        return stack_examples(WindowBatch, [self._one(patch, rng) for _ in range(count)])

    def _one(self, patch: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        window = np.load(self.paths[rng.integers(len(self.paths))], mmap_mode="r")
        around = patch + 8  # room for the blur
        row, column = FACTOR * rng.integers(0, window.shape[1] // FACTOR - around + 1, 2)
        large = window[:, row : row + FACTOR * around, column : column + FACTOR * around].astype(np.float32)
        large = _turned(large, rng)
        small = degraded(large, random_degradation(rng), rng)
        edge = 4
        inner = slice(FACTOR * edge, -FACTOR * edge)
        return small[:, edge:-edge, edge:-edge], large[:, inner, inner]


def random_degradation(rng: np.random.Generator) -> Degradation:
    """Draw from a plain reduction to the soft, faintly noisy maps that sampling a prior gives."""
    blur = rng.uniform(0.0, 0.8) if rng.random() < 0.7 else 0.0
    return Degradation(
        blur,
        min(1.2, blur + rng.uniform(0.0, 0.5)) if rng.random() < 0.7 else blur,
        rng.uniform(0.0, 0.006),
        rng.uniform(0.8, 1.0),
    )


def degraded(large: np.ndarray, degradation: Degradation, rng: np.random.Generator) -> np.ndarray:
    """Reduce a large map [7, 4 H, 4 W] (network channels) to a small one [7, H, W].

    The albedo is averaged in linear light, normals are of length one again.
    """
    height, width = large.shape[1] // FACTOR, large.shape[2] // FACTOR
    linear = np.concatenate([images.srgb_to_linear(large[:3]), large[3:]])
    small = linear.reshape(CHANNELS, height, FACTOR, width, FACTOR).mean((2, 4))
    for channels, sigma in ((slice(0, 3), degradation.blur), (slice(3, CHANNELS), degradation.other_blur)):
        if sigma > 0.15:
            small[channels] = cv2.GaussianBlur(small[channels].transpose(1, 2, 0), (0, 0), sigma).transpose(2, 0, 1)
    small[3:5] *= degradation.relief
    small[:3] = images.linear_to_srgb(np.clip(small[:3], 0, 1))
    noise = rng.normal(0, 1, small.shape).astype(np.float32) * degradation.noise
    noise[3:] *= 2
    small = small + noise
    small[:3], small[6] = np.clip(small[:3], 0, 1), np.clip(small[6], 0, 1)
    small[3:6] /= np.maximum(np.linalg.norm(small[3:6], axis=0), 1e-6)
    return small.astype(np.float32)


def _turned(maps: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Mirror and transpose maps at random; the normals turn along."""
    maps = maps.copy()
    if rng.random() < 0.5:
        maps = maps[:, :, ::-1]
        maps[3] *= -1
    if rng.random() < 0.5:
        maps = maps[:, ::-1]
        maps[4] *= -1
    if rng.random() < 0.5:  # rows run against v: transposing swaps x with -y
        maps = maps.transpose(0, 2, 1)[[0, 1, 2, 4, 3, 5, 6]]
        maps[3:5] *= -1
    return maps


def _path(work: Path, seed: int, index: int) -> Path:
    return work / f"window_{seed}_{index}.npy"


def _paint(work: Path, window: tuple[int, int]) -> None:
    """Paint one window, float16 [7, S, S]: three of four lie on the face, the others anywhere on the head."""
    seed, index = window
    rng = np.random.default_rng([seed, 40, index])
    where = _face() if index % 4 != 3 else _head()
    row, column = where[rng.integers(len(where))] * FACTOR - rng.integers(SIDE // 4, 3 * SIDE // 4, 2)
    row, column = (int(np.clip(at // FACTOR * FACTOR, 0, SIZE - SIDE)) for at in (row, column))
    parameters = replace(adorned(sample_parameters(seed), seed), scars=0.0)
    skin = paint_skin(parameters, make_window_canvas(SIZE, row, column, SIDE), canvas(GROUND))
    inner = slice(MARGIN, SIDE - MARGIN)
    maps = np.concatenate([images.linear_to_srgb(skin.diffuse), skin.normal, skin.specular[..., None]], -1)
    with replacing(_path(work, seed, index)) as temporary:
        np.save(temporary, maps[inner, inner].transpose(2, 0, 1).astype(np.float16))


@cache
def _face() -> np.ndarray:
    return np.argwhere(template.mask("face", SIZE // FACTOR) > 0.5)


@cache
def _head() -> np.ndarray:
    return np.argwhere(raster.rasterize_uv(template.load(), SIZE // FACTOR)[0] >= 0)
