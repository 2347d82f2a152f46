# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Random windows of the skins at three scales, and the statistics that the prior's network is built around."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import torch

from core.face import template
from core.solver.prior.prior import make_coordinates, mean_at

from ..people import pigment
from .skins import SCALES, SIZE, Skins, facial_skin, shrink

LN_MELANIN = np.log(0.008), np.log(0.45)
"""Range of the melanin fraction that a skin's tone is moved to: very light to very dark."""
REACH, DARK_REACH = 1.2, 0.4
"""Largest change of the logarithm of melanin; the lower one makes dark skin lighter, whose pigments are known less
well."""


class PatchBatch(NamedTuple):
    """Windows: clean [N, 7, P, P]; known, 1 where `clean` is true; coords [N, 2, P, P]; tone [N, 3]; scale [N]."""

    clean: torch.Tensor
    known: torch.Tensor
    coords: torch.Tensor
    tone: torch.Tensor
    scale: torch.Tensor


class Windows:
    """Draws batches from skins; `real` is the share of the windows that carried skins get."""

    def __init__(self, skins: Skins, real: float = 0.4):
        self.skins = skins
        whole = np.array([area is None for area in skins.known[1]])
        share = np.where(whole, (1 - real) / max(whole.sum(), 1), real / max((~whole).sum(), 1))
        self.chance = share / share.sum()
        self.face = np.argwhere(template.mask("face", SIZE) > 0.5)
        bare = facial_skin(SIZE // SCALES[-1])
        some = np.flatnonzero(bare > 0.9)[::29]  # enough texels of facial skin for its mean
        self.sparse = [
            m[:, some // bare.shape[1], some % bare.shape[1]].float().numpy()[:, None] for m in skins.maps[SCALES[-1]]
        ]

    def draw(self, count: int, patch: int, rng: np.random.Generator, augment: bool = True) -> PatchBatch:
        """Draw windows of side `patch` in texels of their own scale; with `augment`, mirrored and moved in tone.

        A third is of each scale, three quarters are on the face.
        """
        drawn = [self._one(patch, rng, augment) for _ in range(count)]
        return PatchBatch(*(torch.stack(parts) for parts in zip(*drawn, strict=True)))

    def _one(self, patch: int, rng: np.random.Generator, augment: bool) -> tuple[torch.Tensor, ...]:
        scale = SCALES[rng.integers(len(SCALES))]
        index = int(rng.choice(len(self.chance), p=self.chance))
        side = SIZE // scale
        area = self.skins.known[scale][index]
        if area is not None or rng.random() < 0.75:
            centre = self.face[rng.integers(len(self.face))] // scale
            row, column = np.clip(centre - rng.integers(0, patch, 2), 0, side - patch)
        else:
            row, column = rng.integers(0, side - patch + 1, 2)
        window = slice(row, row + patch), slice(column, column + patch)
        maps = self.skins.maps[scale][index][(slice(None), *window)].float()
        clean, tone = maps[:7], self.skins.tones[index]
        known = torch.ones_like(clean)
        if area is not None:
            known = torch.cat([area[window].float().expand(3, -1, -1), torch.zeros(4, patch, patch)])
        coords = make_coordinates(side, *window)[0]
        if augment:
            clean, tone = self._toned(maps.numpy(), index, rng)
            if rng.random() < 0.5:  # the UV layout is symmetric about u = 0.5
                clean, known, coords = clean.flip(2), known.flip(2), torch.stack([-coords[0], coords[1]]).flip(2)
                clean[3] *= -1
        return clean, known, coords, tone, torch.tensor(scale)

    def _toned(self, maps: np.ndarray, index: int, rng: np.random.Generator) -> tuple[torch.Tensor, torch.Tensor]:
        """Give a window [9, P, P] of skin `index` other melanin and blood.

        Returns it with its tone, which is never known exactly.
        """
        sparse = self.sparse[index]
        own = float(np.median(sparse[7]))
        lightest = -DARK_REACH if own > np.log(0.3) else -REACH
        more = (
            rng.uniform(max(LN_MELANIN[0] - own, lightest), np.clip(LN_MELANIN[1] - own, 0, REACH)),
            rng.normal(0, 0.15),
        )
        gain = np.exp(rng.normal(0, 0.08) + rng.normal(0, 0.03, 3))[:, None, None]
        albedo, everywhere = (
            np.clip((m[:3] + 1) / 2 * gain * _change(m[7], m[8], *more), 0, 1) for m in (maps, sparse)
        )
        clean = torch.from_numpy(np.concatenate([2 * albedo - 1, maps[3:7]]).astype(np.float32))
        tone = everywhere.mean((1, 2)) * np.exp(rng.normal(0, 0.06) + rng.normal(0, 0.02, 3))
        return clean, torch.from_numpy(tone.astype(np.float32))


def _change(melanin: np.ndarray, blood: np.ndarray, more_melanin: float, more_blood: float) -> np.ndarray:
    """Return the factor [3, H, W] of an albedo whose pigments, logarithms [H, W], change."""
    before = pigment.reflectance(np.exp(melanin), np.exp(blood))
    after = pigment.reflectance(np.exp(melanin + more_melanin), np.exp(blood + more_blood))
    return np.moveaxis(after / before, -1, 0)


def mean_map(skins: Skins, size: int = 256) -> torch.Tensor:
    """Return the mean face [7, size, size], symmetric: each skin counts where it is known.

    Geometric mean of albedo over tone, mean normal (of length one), mean 2 * specular - 1.
    """
    total, weight = torch.zeros(7, size, size), torch.zeros(7, size, size)
    for small, area, tone in _shrunk(skins, size):
        small[:3] = ((small[:3] + 1) / 2).clamp_min(1e-3).log() - tone.log()[:, None, None]
        known = torch.ones(7, size, size)
        if area is not None:
            factor = len(area) // size
            known[:3], known[3:] = area[::factor, ::factor].float(), 0
        total, weight = total + known * small, weight + known
    mean = total / weight.clamp_min(1e-6)
    mean[:3] = mean[:3].exp()
    mean = (mean + torch.stack([*mean[:3], -mean[3], *mean[4:]]).flip(2)) / 2
    mean[3:6] /= mean[3:6].norm(dim=0).clamp_min(1e-6)
    return mean


def reference_skins(skins: Skins, count: int = 16, size: int = 128) -> torch.Tensor:
    """Return the first `count` whole skins [count, 7, size, size]: albedo over tone, normal, 2 * specular - 1."""
    references = []
    for small, area, tone in _shrunk(skins, size):
        if area is None and len(references) < count:
            small[:3] = (small[:3] + 1) / 2 / tone[:, None, None]
            small[3:6] /= small[3:6].norm(dim=0).clamp_min(1e-6)
            references.append(small)
    return torch.stack(references)


def _shrunk(skins: Skins, size: int) -> Iterator[tuple[torch.Tensor, torch.Tensor | None, torch.Tensor]]:
    """Yield each skin's map [7, size, size], where it is known, and its tone."""
    for maps, area, tone in zip(skins.maps[SCALES[1]], skins.known[SCALES[1]], skins.tones, strict=True):
        yield torch.from_numpy(shrink(maps.numpy(), maps.shape[-1] // size))[:7].float(), area, tone


def spread_about(windows: Windows, mean: torch.Tensor, patch: int) -> torch.Tensor:
    """Return the deviation [7] of random windows from the mean face of their tone, of the albedo in units of it."""
    batch = windows.draw(256, patch, np.random.default_rng(3))
    difference = batch.clean - mean_at(mean, batch.coords, batch.tone)
    difference[:, :3] /= batch.tone[:, :, None, None]
    return ((difference**2 * batch.known).sum((0, 2, 3)) / batch.known.sum((0, 2, 3))).sqrt()
