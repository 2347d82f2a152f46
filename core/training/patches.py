# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches of synthetic reflectance maps for the prior: skins made once into a cache, then random windows at three scales.

A map is [7, S, S] float16: 2 * diffuse_linear - 1, tangent-space normal xyz, 2 * specular - 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch

from .. import template
from ..capture import replacing
from ..messages import Reporter
from ..solve.prior import coordinates, mean_at
from ..synthetic.skin import make_skin

SIZE = 1024
SCALES = (1, 2, 4)
"""Sides of a texel in texels of the 1024 map; the solver goes from coarse to fine over them."""


@dataclass(frozen=True)
class Skins:
    """maps[scale]: float16 tensors [7, SIZE / scale, SIZE / scale], one per skin; tones: linear RGB float32 [N, 3]."""

    maps: dict[int, list[torch.Tensor]]
    tones: torch.Tensor
    face: torch.Tensor  # int64 [M, 2]: rows and columns of face texels of the SIZE map


@dataclass(frozen=True)
class Batch:
    """clean [N, 7, P, P], coords [N, 2, P, P], tone [N, 3], scale [N]; float32."""

    clean: torch.Tensor
    coords: torch.Tensor
    tone: torch.Tensor
    scale: torch.Tensor


def make_skins(seeds: list[int], cache: Path, report: Reporter) -> Skins:
    """The skins of these seeds with their coarser versions; those the cache lacks are made first (some seconds each)."""
    maps: dict[int, list[torch.Tensor]] = {scale: [] for scale in SCALES}
    tones = []
    skin = template.mask("skin", SIZE)
    for i, seed in enumerate(seeds):
        path = Path(cache) / f"skin_{seed}_{SIZE}.npy"
        if not path.is_file():
            with replacing(path) as temporary, open(temporary, "wb") as file:
                np.save(file, make_map(seed, SIZE))
        full = np.load(path)
        for scale in SCALES:
            maps[scale].append(torch.from_numpy(shrink(full, scale)))
        tones.append(((full[:3].astype(np.float32) + 1) / 2 * skin).sum((1, 2)) / skin.sum())
        report.progress(i + 1, len(seeds), f"skin {i + 1} of {len(seeds)}")
    face = torch.from_numpy(np.argwhere(template.mask("face", SIZE) > 0.5))
    return Skins(maps, torch.from_numpy(np.stack(tones)).float(), face)


def make_map(seed: int, size: int) -> np.ndarray:
    """The reflectance map of one synthetic skin, float16 [7, size, size]."""
    made = make_skin(seed, size)
    channels = [2 * made.diffuse - 1, made.normal, 2 * made.specular[..., None] - 1]
    return np.concatenate(channels, -1).transpose(2, 0, 1).astype(np.float16)


def shrink(full: np.ndarray, scale: int) -> np.ndarray:
    """A map [7, S, S] averaged over scale x scale texels, its normals of length one again."""
    if scale == 1:
        return full
    side = full.shape[-1] // scale
    small = np.stack([cv2.resize(channel.astype(np.float32), (side, side), interpolation=cv2.INTER_AREA) for channel in full])
    small[3:6] /= np.maximum(np.linalg.norm(small[3:6], axis=0), 1e-6)
    return small.astype(full.dtype)


def draw(skins: Skins, count: int, patch: int, rng: np.random.Generator, augment: bool = True) -> Batch:
    """`count` random windows: a third of each scale, three quarters of them on the face; mirrored and re-toned when `augment`."""
    clean, places, tones, scales = [], [], [], []
    for _ in range(count):
        scale = SCALES[rng.integers(len(SCALES))]
        index = rng.integers(len(skins.tones))
        side = SIZE // scale
        if rng.random() < 0.75:
            centre = skins.face[rng.integers(len(skins.face))].numpy() // scale
            row, column = np.clip(centre - rng.integers(0, patch, 2), 0, side - patch)
        else:
            row, column = rng.integers(0, side - patch + 1, 2)
        window = skins.maps[scale][index][:, row:row + patch, column:column + patch].float()
        coords = coordinates(side, slice(row, row + patch), slice(column, column + patch))
        tone = skins.tones[index]
        if augment:
            if rng.random() < 0.5:  # the UV layout is symmetric about u = 0.5
                window, coords = window.flip(2), torch.stack([-coords[:, 0], coords[:, 1]], 1).flip(3)
                window[3] *= -1
            gain = torch.from_numpy(np.exp(rng.normal(0, 0.1) + rng.normal(0, 0.04, 3))).float()
            window[:3] = (window[:3] + 1) * gain[:, None, None] - 1
            tone = tone * gain * torch.from_numpy(np.exp(rng.normal(0, 0.06) + rng.normal(0, 0.02, 3))).float()  # a tone is never known exactly
        clean.append(window)
        places.append(coords[0])
        tones.append(tone)
        scales.append(scale)
    return Batch(torch.stack(clean), torch.stack(places), torch.stack(tones), torch.tensor(scales))


def mean_map(skins: Skins, size: int = 256) -> torch.Tensor:
    """The mean face [7, size, size], symmetric: geometric mean of albedo over tone, mean normal (of length one), mean 2 * specular - 1."""
    small = [torch.from_numpy(shrink(m.numpy(), SIZE // SCALES[1] // size)).float() for m in skins.maps[SCALES[1]]]
    relative = torch.stack([((m[:3] + 1) / 2).clamp_min(1e-3).log() - tone.log()[:, None, None] for m, tone in zip(small, skins.tones, strict=True)])
    mean = torch.cat([relative.mean(0).exp(), torch.stack([m[3:] for m in small]).mean(0)])
    mean = (mean + torch.stack([*mean[:3], -mean[3], *mean[4:]]).flip(2)) / 2
    mean[3:6] /= mean[3:6].norm(dim=0).clamp_min(1e-6)
    return mean


def spread_about(skins: Skins, mean: torch.Tensor, patch: int) -> torch.Tensor:
    """Deviation [7] of random patches from the mean face of their tone; of the albedo in units of the tone."""
    batch = draw(skins, 256, patch, np.random.default_rng(3), augment=False)
    difference = batch.clean - mean_at(mean, batch.coords, batch.tone)
    difference[:, :3] /= batch.tone[:, :, None, None]
    return (difference**2).mean((0, 2, 3)).sqrt()
