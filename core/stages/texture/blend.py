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
from ...imaging.normalized_convolution import weighted_blur
from .held_picture import read_held
from .projection import UnwrappedView

BANDS = ((2.0, 12.0), (8.0, 5.0), (24.0, 2.0), (np.inf, 1.0))
"""(Sigma in texels of a 1024 map up to which a band reaches, exponent of its weights): the best view gives the detail,
all give the tone."""


def equalise(observations: list[UnwrappedView], rounds: int = 6) -> np.ndarray:
    """Bring all views to one exposure and white balance; return the log gains [V, 3] added, of weighted mean zero.

    Alternates between the mean over views and, where a view has a tenth of its best weight, its median difference from
    it, which no highlight moves.
    """
    step = max(1, len(observations[0].weight) // 256)
    colours = np.stack([cv2.blur(o.log_colour, (step, step))[::step, ::step] for o in observations])  # [V, s, s, 3]
    weights = np.stack([cv2.erode(o.weight, np.ones((step, step)))[::step, ::step] for o in observations])
    overlap = (weights > 0).sum(0) > 1
    gains = np.zeros((len(observations), 3))
    mass = weights[:, overlap].sum(1)
    for _ in range(rounds if overlap.any() else 0):
        mean = weighted_mean(list(colours + gains[:, None, None]), list(weights))
        for i, weight in enumerate(weights):
            used = overlap & (weight > 0.1 * weight.max())
            if used.sum() > 50:
                gains[i] += np.median((mean - colours[i])[used] - gains[i], axis=0)
        gains -= np.average(gains, axis=0, weights=np.maximum(mass, 1e-9))
    for observation, gain in zip(observations, gains, strict=True):
        observation.picture = observation.picture.brightened(gain)
        observation.log_colour = observation.log_colour + gain.astype(np.float32)
    return gains


def robust_weights(observations: list[UnwrappedView], tolerance: float = 0.10) -> None:
    """Take weight from views whose local tone disagrees with the weighted median of all.

    That is a highlight, a passing shadow, hair in front. At a log difference of `tolerance` a view keeps half of its
    weight.
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
    """Return one texture [size, size, 3], natural log of linear colour; zeros where no view sees anything.

    covered: bool [S, S], texels of the head. Observations are enlarged one at a time. The progress names the `kind` of
    pictures and starts at `done` steps after the views.
    """
    largest = np.full_like(observations[0].weight, 1e-12)
    for o in observations:
        np.maximum(largest, o.weight, out=largest)
    largest = cv2.resize(largest, (size, size), interpolation=cv2.INTER_LINEAR)
    sums, norms = ([np.zeros((*largest.shape, channels), np.float32) for _ in BANDS] for channels in (3, 1))
    scale, views = len(largest) / 1024, len(observations)
    for i, o in enumerate(observations):
        report.progress(views + done + 2 * i / views, views + 6, f"blending {o.name}, {kind}")
        o = o.enlarged(size, covered)
        observed, share = o.weight > 0, o.weight / largest
        for band, (log_colour, (reach, exponent)) in enumerate(
            zip(bands_of(o.log_colour, observed), BANDS, strict=True)
        ):
            weight = share**exponent
            # feathered where the best view changes, but nothing taken from where the view is blind
            if np.isfinite(reach):
                weight = _feathered(weight, reach, scale) * np.minimum(1, 4 * share)
            sums[band] += log_colour * weight[..., None]
            norms[band] += weight[..., None]
    return sum(s / np.maximum(n, 1e-12) for s, n in zip(sums, norms, strict=True)).astype(np.float32)


def filmed(observations: list[UnwrappedView], covered: np.ndarray, size: int, report: Reporter) -> np.ndarray | None:
    """Return the texture with its light, linear [size, size, 3], 1 where no view sees it; None if a frame is gone.

    covered: bool [S, S], texels of the head. The observations show the frames afterwards.
    """
    if not all(o.view.path.is_file() for o in observations):
        return None
    for o in observations:
        frame = read_held(o.view.path)
        # a delighter may give another size
        o.pixels = o.pixels * np.float32([frame.shape[1] / o.picture.shape[1], frame.shape[0] / o.picture.shape[0]])
        o.picture = frame.around(o.pixels[covered])
        o.log_colour = o.picture.log_colours(o.pixels)
    return np.exp(blend(observations, covered, size, report, "as filmed", 4))


def _feathered(weight: np.ndarray, reach: float, scale: float) -> np.ndarray:
    """Blur weights [S, S] by a sigma of `reach` texels of a 1024 map.

    Larger maps are blurred at 1024: as soft, and the cost of a Gaussian grows with its width.
    """
    if scale <= 1:
        return cv2.GaussianBlur(weight, (0, 0), max(reach * scale, 1))
    small = cv2.GaussianBlur(cv2.resize(weight, (1024, 1024), interpolation=cv2.INTER_AREA), (0, 0), reach)
    return cv2.resize(small, weight.shape[::-1], interpolation=cv2.INTER_LINEAR)


def bands_of(log_colour: np.ndarray, observed: np.ndarray) -> list[np.ndarray]:
    """Split [S, S, 3] into bands that sum to it, fine to coarse."""
    bands, rest = [], log_colour
    for reach, _ in BANDS[:-1]:
        low = blurred(log_colour, observed, reach * (len(observed) / 1024))
        bands.append(rest - low)
        rest = low
    return [*bands, rest]


def blurred(image: np.ndarray, weight: np.ndarray, sigma: float) -> np.ndarray:
    """Blur [S, S(, C)] where weight [S, S] >= 0 says that there is something; large sigmas at lower resolution."""
    return weighted_blur(image, weight, sigma, 1e-8, shrink=max(1, int(sigma // 4)))


def weighted_mean(images: Iterable[np.ndarray], weights: Iterable[np.ndarray]) -> np.ndarray:
    """Return the mean over views of [S, S(, C)] with weights [S, S]; zero where all weights are."""
    top, bottom = 0.0, 1e-12
    for image, weight in zip(images, weights, strict=True):
        weight = weight if image.ndim == 2 else weight[..., None]
        top, bottom = top + image * weight, bottom + weight
    return top / bottom


def _weighted_median(samples: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the weighted median over the first axis of samples [V, h, w]."""
    order = np.argsort(samples, axis=0)
    cumulative = np.cumsum(np.take_along_axis(weights, order, 0), axis=0)
    middle = (cumulative >= 0.5 * cumulative[-1:]).argmax(0)
    return np.take_along_axis(np.take_along_axis(samples, order, 0), middle[None], 0)[0]
