# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure what an answer leaves along the edges of the true shadow: a step, a line, and lost detail.

The residual log(answer / truth), green, is followed across the edge. A step is light that stayed (or was taken twice);
a line brighter or darker than both sides is what a border that was misplaced or blurred leaves, and an eye sees it
first. Lengths are shares of the face's height, so that pictures of any size compare.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from core.light.shadow_edges import signed_distance

from . import pictures

LINE, SIDES = 0.008, (0.016, 0.048)
"""Half width of the line at the edge, and where the two sides lie, as shares of the face's height: 4 px, and 8 to 24
px, of a face of 500 px."""
ALONG = 0.03
"""Deviation of the window along the edge in which line and sides are averaged, so that pores do not count as lines; a
share of the face's height."""
LEAST_SHARE = 0.04
"""Share of a window that each of line and sides must have."""
LEAST_PIXELS = 200


@dataclass(frozen=True)
class EdgeScores:
    """Figures of one picture, differences of natural logarithms, means over the pixels of the edge.

    step: the lit side less the dark one; bright, dark: how far the line lies above or below both sides; overshoot:
    their sum; detail: correlation with the truth's within the band of the edge, and away from it. None without an edge.
    """

    step: float | None
    bright: float | None
    dark: float | None
    detail_within: float | None
    detail_away: float | None

    @property
    def overshoot(self) -> float | None:
        return None if self.bright is None else self.bright + self.dark


def score_edges(
    log: np.ndarray,
    log_true: np.ndarray,
    shadow: np.ndarray,
    mask: np.ndarray,
    height: float,
    lit: np.ndarray | None = None,
) -> EdgeScores:
    """Measure what an answer leaves along the edges of a shadow.

    log, log_true: [H, W], natural logarithms of linear green of answer and truth; shadow: bool [H, W], the true one;
    mask: bool [H, W], pixels that count; lit: bool [H, W], where along the edge the light really steps (a terminator
    fades, and is no edge for a narrow window); None: everywhere."""
    if not (shadow & mask).any() or not (~shadow & mask).any():
        return EdgeScores(None, None, None, None, None)
    distance, residual = signed_distance(shadow), np.where(mask, log - log_true, 0).astype(np.float32)
    zones = [np.abs(distance) < LINE * height, _between(distance, height), _between(-distance, height)]
    means, near = [], np.ones(mask.shape, bool)
    for zone in zones:
        weight = (zone & mask).astype(np.float32)
        around = cv2.GaussianBlur(weight, (0, 0), ALONG * height)
        means.append(cv2.GaussianBlur(weight * residual, (0, 0), ALONG * height) / np.maximum(around, 1e-6))
        near &= around > LEAST_SHARE
    at = zones[0] & mask & near & (True if lit is None else lit)
    if at.sum() < LEAST_PIXELS:
        return EdgeScores(None, None, None, None, None)
    line, bright_side, dark_side = (mean[at] for mean in means)
    above = np.maximum(line - np.maximum(bright_side, dark_side), 0)
    below = np.maximum(np.minimum(bright_side, dark_side) - line, 0)
    band = cv2.dilate(at.astype(np.uint8), np.ones((2 * max(round(LINE * height), 1) + 1,) * 2, np.uint8)) > 0
    return EdgeScores(
        float((bright_side - dark_side).mean()),
        float(above.mean()),
        float(below.mean()),
        *_detail(log, log_true, mask, band),
    )


def _between(distance: np.ndarray, height: float) -> np.ndarray:
    return (distance > SIDES[0] * height) & (distance < SIDES[1] * height)


def _detail(
    log: np.ndarray, log_true: np.ndarray, mask: np.ndarray, band: np.ndarray
) -> tuple[float | None, float | None]:
    """Return the correlation of the fine bands of two logarithms within a band [H, W] and off it."""
    (one, true), inner = pictures.fine_bands(log, log_true, mask)
    within, away = (
        pictures.correlation(one[where], true[where]) if where.sum() >= LEAST_PIXELS else None
        for where in (inner & band, inner & ~band)
    )
    return within, away
