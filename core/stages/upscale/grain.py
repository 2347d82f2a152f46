# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Paint pores and mottling like those of the solved skin where no camera saw any.

Their strength and colours are measured band by band on the skin that was seen, and noise of the same bands is painted
at points in space, so that no UV seam shows. Colour, gloss and height share one noise where they go together on the
solved skin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from ...geometry.noise import noise
from ...imaging.normalized_convolution import weighted_blur
from .surface import HeadSurface

SIGMAS_MM = (0.24, 0.48, 0.96, 1.92)  # the bands lie between them, the first one below the first
# of the noises that are mixed, one for each band. Larger shapes differ from place to place for a reason (blood, bone,
# light) and are left to the tone: repeated as noise they look like a stain
WAVELENGTHS_MM = (0.55, 1.1, 2.2, 4.4)
STEP_MM = 0.05  # between two points of whose heights a slope is taken
LEAST_TEXELS_PER_WAVE = 1.2  # of a wavelength that is painted in full
SAMPLE_TEXELS = 200_000  # enough to measure how strong a noise is in the bands


@dataclass(frozen=True)
class Grain:
    """Grain per wavelength.

    mix [K, 4, 4]: from independent noises (the first carries the most) to log albedo [3] and specular; slope [K]:
    height's contribution to either slope of the normal; tie [K]: 1 where bright is high.
    """

    mix: np.ndarray
    slope: np.ndarray
    tie: np.ndarray


def measure(channels: np.ndarray, slopes: np.ndarray, weight: np.ndarray, surface: HeadSurface, seed: int = 0) -> Grain:
    """Measure the grain of skin that was seen.

    channels [S, S, 4]: log albedo and specular; slopes [S, S, 2]: x / z and y / z of the normal; weight [S, S] in [0,
    1]: skin to learn from; seed: of the noises that are compared.
    """
    where = weight > 0.99
    texel = float(np.median(surface.texel[where])) if where.any() else 1.0
    covariances = [_covariance(band, where) for band in bands(channels, weight, texel)]
    of_slopes = [_covariance(band, where) for band in bands(slopes, weight, texel)]
    answer, answer_slope = _answers(surface, where, texel, np.random.default_rng([seed, 1]))
    mix, tie = np.zeros((len(WAVELENGTHS_MM), 4, 4)), np.ones(len(WAVELENGTHS_MM))
    strength = np.stack([nnls(answer, [cov[i, i] for cov in covariances])[0] for i in range(4)], 1)  # [K, 4] variances
    for k, variance in enumerate(strength):
        deviation = np.sqrt(np.maximum(np.diag(covariances[k]), 1e-12))
        together = covariances[k] / np.outer(deviation, deviation)
        eigenvalues, vectors = np.linalg.eigh(together * np.sqrt(np.outer(variance, variance)))
        mix[k] = (vectors * np.sqrt(np.maximum(eigenvalues, 0)))[:, ::-1]
        tie[k] = 1.0 if mix[k][:3, 0].sum() >= 0 else -1.0
    slope = np.sqrt(nnls(answer_slope, [np.trace(cov) / 2 for cov in of_slopes])[0])
    return Grain(mix, slope, tie)


def paint(grain: Grain, surface: HeadSurface, mask: np.ndarray, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return the grain on the N texels of bool [S, S]: log albedo and specular [N, 4] and slopes [N, 2], of mean 0.

    The same seed paints the same head alike at any size.
    """
    points, texel = surface.position[mask], surface.texel[mask]
    tangent, bitangent = surface.frames(mask)
    channels, slopes = np.zeros((len(points), 4), np.float32), np.zeros((len(points), 2), np.float32)
    for k, wavelength in enumerate(WAVELENGTHS_MM):
        coarser = np.maximum(texel - surface.texel.min(), 0)
        fits = np.exp(-0.5 * (LEAST_TEXELS_PER_WAVE * coarser / wavelength) ** 2)[:, None]
        height = noise(points, wavelength, _generator(seed, k, 0))
        parts = np.stack([height, *(noise(points, wavelength, _generator(seed, k, i)) for i in (1, 2, 3))], 1)
        channels += fits * (parts @ grain.mix[k].T.astype(np.float32))
        if grain.slope[k] > 0:
            aside = (points + np.float32(STEP_MM) * way.astype(np.float32) for way in (tangent, bitangent))
            rise = [noise(each, wavelength, _generator(seed, k, 0)) - height for each in aside]
            slopes -= np.float32(grain.slope[k] * grain.tie[k] / STEP_MM) * fits * np.stack(rise, 1)
    return channels, slopes


def bands(picture: np.ndarray, weight: np.ndarray, texel: float) -> list[np.ndarray]:
    """Return the bands [S, S, C] of a picture, fine to coarse, under weights [S, S] of its texels of that many mm."""
    levels, finer = [], picture
    for sigma in SIGMAS_MM:
        coarser = blurred(picture, weight, sigma / texel)
        levels.append(finer - coarser)
        finer = coarser
    return levels


def blurred(picture: np.ndarray, weight: np.ndarray, sigma: float) -> np.ndarray:
    """Return the Gaussian mean of [S, S, C] under weights [S, S]; sigma in texels."""
    return weighted_blur(picture, weight, max(sigma, 0.3), 1e-4)


def _answers(
    surface: HeadSurface, mask: np.ndarray, texel: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return the variances [band, wavelength] in the map's bands of a noise of deviation 1, and of its slopes."""
    side = int(min(np.sqrt(SAMPLE_TEXELS), surface.size))
    top, left = (
        int(np.clip(np.median(at) - side / 2, 0, surface.size - side)) if len(at) else 0 for at in np.nonzero(mask)
    )
    window = np.s_[top : top + side, left : left + side]
    points, inner = surface.position[window].reshape(-1, 3), np.ones((side, side), np.float32)
    sampled = np.zeros(surface.covered.shape, bool)
    sampled[window] = True
    tangent = surface.frames(sampled)[0].astype(np.float32)
    variances = np.zeros((2, len(SIGMAS_MM), len(WAVELENGTHS_MM)))
    for k, wavelength in enumerate(WAVELENGTHS_MM):
        seed = int(rng.integers(1 << 31))
        height, aside = (
            noise(at, wavelength, np.random.default_rng(seed))
            for at in (points, points + np.float32(STEP_MM) * tangent)
        )
        both = np.stack([height, (aside - height) / STEP_MM], 1).reshape(side, side, 2)
        for b, band in enumerate(bands(both, inner, texel)):
            variances[:, b, k] = band.reshape(-1, 2).var(0)
    return variances[0], variances[1]


def _generator(seed: int, wavelength: int, channel: int) -> np.random.Generator:
    return np.random.default_rng([seed, 2, wavelength, channel])


def _covariance(band: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Return that [C, C] of a band's texels, clipped, as moles, hairs and the edges of shadows lie far out."""
    if where.sum() <= 100:
        return np.zeros((band.shape[-1],) * 2)
    samples = band[where]
    middle, (low, high) = np.median(samples, 0), np.percentile(samples, [16, 84], axis=0)
    reach = 2.5 * np.maximum(high - low, 1e-9) / 2
    return np.cov(np.clip(samples, middle - reach, middle + reach), rowvar=False)
