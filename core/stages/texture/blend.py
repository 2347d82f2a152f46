# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Many views into one map: exposure gains, outliers, and a blend in bands (after Burt and Adelson 1983).

All in the logarithm of linear colour: a gain is an offset there, and a band of detail is a ratio.
"""

from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np

from ...capture.messages import Reporter
from .projection import UnwrappedView

BANDS = ((2.0, 12.0), (8.0, 5.0), (24.0, 2.0), (np.inf, 1.0))
"""(sigma in texels of a 1024 map up to which a band reaches, exponent of the weights in it): details come from the best
view, tone from all."""


def equalise(observations: list[UnwrappedView], rounds: int = 6) -> np.ndarray:
    """Brings all views to one exposure and white balance; returns the log gains [views, 3] that were added (weighted
    mean zero).

    Alternates between the mean over views and, where a view has a tenth of its best weight, its median difference from
    it, which no highlight moves.
    """
    step = max(1, len(observations[0].weight) // 256)
    colours = np.stack([cv2.blur(o.log_colour, (step, step))[::step, ::step] for o in observations])  # [V, s, s, 3]
    weights = np.stack([cv2.erode(o.weight, np.ones((step, step)))[::step, ::step] for o in observations])
    overlap = (weights > 0).sum(0) > 1
    gains = np.zeros((len(observations), 3))
    mass = weights[:, overlap].sum(1)
    if overlap.any():
        for _ in range(rounds):
            mean = weighted_mean(list(colours + gains[:, None, None]), list(weights))
            for i in range(len(observations)):
                used = overlap & (weights[i] > 0.1 * weights[i].max())
                if used.sum() > 50:
                    gains[i] += np.median((mean - colours[i])[used] - gains[i], axis=0)
            gains -= np.average(gains, axis=0, weights=np.maximum(mass, 1e-9))
    for observation, gain in zip(observations, gains, strict=True):
        observation.picture = observation.picture.brightened(gain)
        observation.log_colour = observation.log_colour + gain.astype(np.float32)
    return gains


def robust_weights(observations: list[UnwrappedView], tolerance: float = 0.10) -> None:
    """Takes weight from views whose tone disagrees with the weighted median of all (a highlight, a passing shadow, hair
    in front).

    tolerance: log difference of local tone at which a view keeps half of its weight.
    """
    if len(observations) < 3:
        return
    scale = len(observations[0].weight) / 1024
    cells = (max(1, len(observations[0].weight) // max(1, round(4 * scale))),) * 2
    tones, weights = [], []
    for o in observations:
        tone = blurred(o.log_colour.mean(-1), (o.weight > 0).astype(np.float32), 4 * scale)
        tones.append(cv2.resize(tone, cells, interpolation=cv2.INTER_AREA))
        weights.append(cv2.resize(o.weight, cells, interpolation=cv2.INTER_AREA))
    median = _weighted_median(np.stack(tones), np.stack(weights))
    for o, tone in zip(observations, tones, strict=True):
        factor = (1 / (1 + ((tone - median) / tolerance) ** 2)).astype(np.float32)
        o.weight = o.weight * cv2.resize(factor, o.weight.shape[::-1], interpolation=cv2.INTER_LINEAR)


def blend(
    observations: list[UnwrappedView],
    covered: np.ndarray,
    size: int,
    report: Reporter,
    kind: str = "delit",
    done: int = 2,
) -> np.ndarray:
    """One texture of observations, each enlarged when its turn comes.

    Parameters
    ----------
    observations : the views
    covered : bool [S, S], texels of the head
    size : texels along a side of the result
    report : hears of progress
    kind : a word for what is blended
    done : steps of the progress before

    Returns
    -------
    [size, size, 3], natural log of linear colour; zeros where nobody looked.
    """
    largest = np.full_like(observations[0].weight, 1e-12)
    for o in observations:
        np.maximum(largest, o.weight, out=largest)
    largest = cv2.resize(largest, (size, size), interpolation=cv2.INTER_LINEAR)
    sums, norms = ([np.zeros((*largest.shape, channels), np.float32) for _ in BANDS] for channels in (3, 1))
    scale = len(largest) / 1024
    for i, o in enumerate(observations):
        report.progress(
            len(observations) + done + 2 * i / len(observations), len(observations) + 6, f"blending {o.name}, {kind}"
        )
        o = o.enlarged(size, covered)
        seen, share = o.weight > 0, o.weight / largest
        for band, (log_colour, (reach, exponent)) in enumerate(zip(bands_of(o.log_colour, seen), BANDS, strict=True)):
            weight = share**exponent
            # feathered where the best view changes, but nothing taken from where the view is blind
            if np.isfinite(reach):
                weight = _feathered(weight, reach, scale) * np.minimum(1, 4 * share)
            sums[band] += log_colour * weight[..., None]
            norms[band] += weight[..., None]
    return sum(s / np.maximum(n, 1e-12) for s, n in zip(sums, norms, strict=True)).astype(np.float32)


def _feathered(weight: np.ndarray, reach: float, scale: float) -> np.ndarray:
    """Gaussian mean of weights [S, S] over `reach` texels of a 1024 map. Of a larger map it is taken at 1024: it is as
    soft there, and the cost of a Gaussian grows with its width."""
    if scale <= 1:
        return cv2.GaussianBlur(weight, (0, 0), max(reach * scale, 1))
    small = cv2.GaussianBlur(cv2.resize(weight, (1024, 1024), interpolation=cv2.INTER_AREA), (0, 0), reach)
    return cv2.resize(small, weight.shape[::-1], interpolation=cv2.INTER_LINEAR)


def bands_of(log_colour: np.ndarray, observed: np.ndarray) -> list[np.ndarray]:
    """Splits [S, S, 3] into bands that sum to it, fine to coarse."""
    scale = len(observed) / 1024
    mask = observed.astype(np.float32)
    bands, rest = [], log_colour
    for reach, _ in BANDS[:-1]:
        low = blurred(log_colour, mask, reach * scale)
        bands.append(rest - low)
        rest = low
    return [*bands, rest]


def blurred(image: np.ndarray, weight: np.ndarray, sigma: float) -> np.ndarray:
    """Gaussian mean of [S, S(, C)] over where weight [S, S] >= 0 says there is something (normalised convolution);
    large sigmas at lower resolution."""
    height, width = weight.shape
    factor = max(1, int(sigma // 4))
    weighted = image * (weight if image.ndim == 2 else weight[..., None])
    if factor > 1:
        small = max(1, width // factor), max(1, height // factor)
        weighted, weight = (cv2.resize(x, small, interpolation=cv2.INTER_AREA) for x in (weighted, weight))
    top, bottom = (cv2.GaussianBlur(x, (0, 0), sigma / factor) for x in (weighted, weight))
    mean = top / np.maximum(bottom if image.ndim == 2 else bottom[..., None], 1e-8)
    return cv2.resize(mean, (width, height), interpolation=cv2.INTER_LINEAR) if factor > 1 else mean


def weighted_mean(images: Iterable[np.ndarray], weights: Iterable[np.ndarray]) -> np.ndarray:
    """Mean over views of [S, S(, C)] with weights [S, S]; zero where all weights are."""
    top, bottom = 0.0, 1e-12
    for image, weight in zip(images, weights, strict=True):
        weight = weight if image.ndim == 2 else weight[..., None]
        top, bottom = top + image * weight, bottom + weight
    return top / bottom


def _weighted_median(samples: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Along the first axis of two [V, h, w]."""
    order = np.argsort(samples, axis=0)
    cumulative = np.cumsum(np.take_along_axis(weights, order, 0), axis=0)
    middle = (cumulative >= 0.5 * cumulative[-1:]).argmax(0)
    return np.take_along_axis(np.take_along_axis(samples, order, 0), middle[None], 0)[0]
