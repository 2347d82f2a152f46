# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the upscaler learns from: windows of synthetic skins painted at 4096, and what a solver's 1024 map of the same
place would be.

Only the windows are painted, never a whole 4096 map: a skin is a function of points on the head.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial
from multiprocessing import get_context
from pathlib import Path

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

SIZE = 4096
SIDE, MARGIN = 1024, 96
"""Texels of a painted window, and its border that is cut off: a hair whose root is outside is laid onto it. Scars, laid
over any distance, are left out."""
FACTOR, CHANNELS = 4, 7


@dataclass(frozen=True)
class Degradation:
    """What the solver's maps lack beside size: sigma of a blur in texels of the small map, of the diffuse and of the
    other channels; deviation of the noise (sRGB of the diffuse; the others take twice as much); the share of their fine
    relief that normals keep."""

    blur: float
    other_blur: float
    noise: float
    relief: float


def prepare(seeds: list[int], views: int, work: Path, report: Reporter, workers: int) -> None:
    """Paints windows of skins, those that are missing (some seconds each).

    Parameters
    ----------
    seeds : the subjects
    views : windows of each
    work : folder in which they are kept
    report : hears of progress
    workers : processes
    """
    wanted = [(seed, i) for seed in seeds for i in range(views) if not _path(work, seed, i).is_file()]
    if not wanted:
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for done, _ in enumerate(pool.map(partial(_paint, Path(work)), wanted)):
            report.progress(done + 1, len(wanted), f"window {done + 1} of {len(wanted)}")


class FineWindows:
    """Draws pairs (small, large) from prepared windows: float32 [N, 7, P, P] and [N, 7, 4P, 4P] in the network's
    channels."""

    def __init__(self, seeds: list[int], views: int, work: Path):
        self.paths = [_path(work, seed, i) for seed in seeds for i in range(views)]

    def draw(self, count: int, patch: int, rng: np.random.Generator) -> tuple[torch.Tensor, torch.Tensor]:
        pairs = [self._one(patch, rng) for _ in range(count)]
        return torch.stack([small for small, _ in pairs]), torch.stack([large for _, large in pairs])

    def _one(self, patch: int, rng: np.random.Generator) -> tuple[torch.Tensor, torch.Tensor]:
        window = np.load(self.paths[rng.integers(len(self.paths))], mmap_mode="r")
        around = patch + 8  # room for the blur
        row, column = FACTOR * rng.integers(0, window.shape[1] // FACTOR - around + 1, 2)
        large = window[:, row : row + FACTOR * around, column : column + FACTOR * around].astype(np.float32)
        large = _turned(large, rng)
        small = degraded(large, random_degradation(rng), rng)
        edge = 4
        return (
            torch.from_numpy(np.ascontiguousarray(small[:, edge:-edge, edge:-edge])),
            torch.from_numpy(
                np.ascontiguousarray(large[:, FACTOR * edge : -FACTOR * edge, FACTOR * edge : -FACTOR * edge])
            ),
        )


def random_degradation(rng: np.random.Generator) -> Degradation:
    """From a plain reduction to the soft, faintly noisy maps that sampling a prior gives."""
    blur = rng.uniform(0.0, 0.8) if rng.random() < 0.7 else 0.0
    return Degradation(
        blur,
        min(1.2, blur + rng.uniform(0.0, 0.5)) if rng.random() < 0.7 else blur,
        rng.uniform(0.0, 0.006),
        rng.uniform(0.8, 1.0),
    )


def degraded(large: np.ndarray, degradation: Degradation, rng: np.random.Generator) -> np.ndarray:
    """The small map [7, H, W] (network channels) of a large one [7, 4H, 4W]: the albedo is averaged in linear light,
    normals are of length one again."""
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
    """Mirrored and transposed at random; the normals turn along."""
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
    return Path(work) / f"window_{seed}_{index}.npy"


def _paint(work: Path, window: tuple[int, int]) -> None:
    """One window as float16 [7, S, S]: three of four lie on the face, the others anywhere on the head."""
    seed, index = window
    rng = np.random.default_rng([seed, 40, index])
    where = _face() if index % 4 != 3 else _head()
    row, column = where[rng.integers(len(where))] * FACTOR - rng.integers(SIDE // 4, 3 * SIDE // 4, 2)
    row, column = (int(np.clip(at // FACTOR * FACTOR, 0, SIZE - SIDE)) for at in (row, column))
    parameters = replace(adorned(sample_parameters(seed), seed), scars=0.0)
    skin = paint_skin(parameters, make_window_canvas(SIZE, row, column, SIDE), canvas(GROUND))
    inner = slice(MARGIN, SIDE - MARGIN)
    maps = np.concatenate([images.linear_to_srgb(skin.diffuse), skin.normal, skin.specular[..., None]], -1)[
        inner, inner
    ]
    with replacing(_path(work, seed, index)) as temporary, open(temporary, "wb") as file:
        np.save(file, maps.transpose(2, 0, 1).astype(np.float16))


@cache
def _face() -> np.ndarray:
    return np.argwhere(template.mask("face", SIZE // FACTOR) > 0.5)


@cache
def _head() -> np.ndarray:
    return np.argwhere(raster.rasterize_uv(template.load(), SIZE // FACTOR)[0] >= 0)
