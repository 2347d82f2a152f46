# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pores and mottling like those of the solved skin, where no camera saw any: their strength and their colours are
measured band by band on the skin that was seen, and noise of the same bands is painted at points in space, so that no
UV seam shows.

Colour, gloss and height share one noise where they go together on the solved skin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from ...geometry.noise import noise
from ...imaging.normalized_convolution import weighted_blur
from .surface import HeadSurface

SIGMAS_MM = (0.24, 0.48, 0.96, 1.92)
"""mm; the bands lie between them, the first one below the first."""
WAVELENGTHS_MM = (0.55, 1.1, 2.2, 4.4)
"""mm; of the noises that are mixed, one for each band. What is larger differs from place to place for a reason (blood,
bone, light) and is left to the tone: repeated as noise it looks like a stain."""
STEP_MM = 0.05
"""mm between two points of whose heights a slope is taken."""
LEAST_TEXELS_PER_WAVE = 1.2
"""How many texels a wavelength must span at least to be painted in full."""
SAMPLE_TEXELS = 200_000
"""So many texels are enough to measure how a noise answers to the bands."""


@dataclass(frozen=True)
class Grain:
    """Per wavelength: mix [K, 4, 4], from independent noises (the first carries the most) to log albedo [3] and
    specular; slope [K]: height's contribution to either slope of the normal; tie [K]: 1 where bright is high."""

    mix: np.ndarray
    slope: np.ndarray
    tie: np.ndarray


def measure(channels: np.ndarray, slopes: np.ndarray, weight: np.ndarray, surface: HeadSurface, seed: int = 0) -> Grain:
    """The grain of skin that was seen.

    Parameters
    ----------
    channels : [S, S, 4], log albedo and specular
    slopes : [S, S, 2], of the normal, x / z and y / z
    weight : [S, S] in [0, 1], where there is skin to learn from
    surface : of the head
    seed : of the noises that are compared
    """
    where = weight > 0.99
    texel = float(np.median(surface.texel[where])) if where.any() else 1.0
    parts = [bands(picture, weight, texel) for picture in (channels, slopes)]
    moments = [
        [
            np.cov(_clipped(band[where]), rowvar=False) if where.sum() > 100 else np.zeros((band.shape[-1],) * 2)
            for band in picture_bands
        ]
        for picture_bands in parts
    ]
    answer, answer_slope = _answers(surface, where, texel, np.random.default_rng([seed, 1]))
    mix, tie = np.zeros((len(WAVELENGTHS_MM), 4, 4)), np.ones(len(WAVELENGTHS_MM))
    strength = np.stack([nnls(answer, [cov[i, i] for cov in moments[0]])[0] for i in range(4)], 1)  # [K, 4] variances
    for k, variance in enumerate(strength):
        deviation = np.sqrt(np.maximum(np.diag(moments[0][k]), 1e-12))
        together = moments[0][k] / np.outer(deviation, deviation)
        eigenvalues, vectors = np.linalg.eigh(together * np.sqrt(np.outer(variance, variance)))
        mix[k] = (vectors * np.sqrt(np.maximum(eigenvalues, 0)))[:, ::-1]
        tie[k] = 1.0 if mix[k][:3, 0].sum() >= 0 else -1.0
    slope = np.sqrt(nnls(answer_slope, [np.trace(cov) / 2 for cov in moments[1]])[0])
    return Grain(mix, slope, tie)


def paint(grain: Grain, surface: HeadSurface, mask: np.ndarray, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """The grain on texels of a head. The same seed paints the same head alike at any size.

    Parameters
    ----------
    grain : as measured
    surface : of the head
    mask : bool [S, S], the N texels that are painted
    seed : of the noise

    Returns
    -------
    Log albedo and specular [N, 4] and slopes [N, 2], all of mean 0.
    """
    points, texel = surface.position[mask], surface.texel[mask]
    tangent, bitangent = surface.frames(mask)
    channels, slopes = np.zeros((len(points), 4), np.float32), np.zeros((len(points), 2), np.float32)
    for k, wavelength in enumerate(WAVELENGTHS_MM):
        fits = np.exp(-0.5 * (LEAST_TEXELS_PER_WAVE * np.maximum(texel - surface.texel.min(), 0) / wavelength) ** 2)[
            :, None
        ]
        height = noise(points, wavelength, _begun(seed, k, 0))
        parts = np.stack([height, *(noise(points, wavelength, _begun(seed, k, i)) for i in (1, 2, 3))], 1)
        channels += fits * (parts @ grain.mix[k].T.astype(np.float32))
        if grain.slope[k] > 0:
            rise = [
                noise(points + np.float32(STEP_MM) * way.astype(np.float32), wavelength, _begun(seed, k, 0)) - height
                for way in (tangent, bitangent)
            ]
            slopes -= np.float32(grain.slope[k] * grain.tie[k] / STEP_MM) * fits * np.stack(rise, 1)
    return channels, slopes


def bands(picture: np.ndarray, weight: np.ndarray, texel: float) -> list[np.ndarray]:
    """The bands [S, S, C] of a picture, fine to coarse, by means that count texels by their weight [S, S]; texel in
    mm."""
    levels, finer = [], picture
    for sigma in SIGMAS_MM:
        coarser = blurred(picture, weight, sigma / texel)
        levels.append(finer - coarser)
        finer = coarser
    return levels


def blurred(picture: np.ndarray, weight: np.ndarray, sigma: float) -> np.ndarray:
    """Gaussian mean of [S, S, C] by weight [S, S]; sigma in texels."""
    return weighted_blur(picture, weight, max(sigma, 0.3), 1e-4)


def _answers(
    surface: HeadSurface, mask: np.ndarray, texel: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Variances [band, wavelength] that a noise of deviation 1, and the slopes of such a height, have in each band of
    the map."""
    rows, columns = np.nonzero(mask)
    side = int(min(np.sqrt(SAMPLE_TEXELS), surface.size))
    top, left = (
        int(np.clip(np.median(at) - side / 2, 0, surface.size - side)) if len(at) else 0 for at in (rows, columns)
    )
    window = np.s_[top : top + side, left : left + side]
    points, inner = surface.position[window].reshape(-1, 3), np.ones((side, side), np.float32)
    there = np.zeros(surface.covered.shape, bool)
    there[window] = True
    tangent = surface.frames(there)[0].astype(np.float32)
    variances = np.zeros((2, len(SIGMAS_MM), len(WAVELENGTHS_MM)))
    for k, wavelength in enumerate(WAVELENGTHS_MM):
        seed = int(rng.integers(1 << 31))
        height = noise(points, wavelength, np.random.default_rng(seed))
        rise = (
            noise(points + np.float32(STEP_MM) * tangent, wavelength, np.random.default_rng(seed)) - height
        ) / STEP_MM
        both = np.stack([height, rise], 1).reshape(side, side, 2)
        for b, band in enumerate(bands(both, inner, texel)):
            variances[:, b, k] = band.reshape(-1, 2).var(0)
    return variances[0], variances[1]


def _begun(seed: int, wavelength: int, channel: int) -> np.random.Generator:
    return np.random.default_rng([seed, 2, wavelength, channel])


def _clipped(samples: np.ndarray) -> np.ndarray:
    """Without what is no grain: moles, hairs and the edges of shadows lie far out."""
    middle, (low, high) = np.median(samples, 0), np.percentile(samples, [16, 84], axis=0)
    reach = 2.5 * np.maximum(high - low, 1e-9) / 2
    return np.clip(samples, middle - reach, middle + reach)
