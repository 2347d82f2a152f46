# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture of a video or a folder of photographs, and the sampling that both share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...imaging import images
from ...imaging.focal import Focal


@dataclass(frozen=True)
class Picture:
    """A sampled picture: srgb [H, W, 3], upright and at its final size, and its place in the source.

    index: decoded frame or sorted file; time_s: None for a photograph; source: file name of a photograph; focal_px at
    this size if the file states it; progress of the reading, `done` of `of`; full [h, w, 3]: the same picture larger,
    for the features that cameras are found by, if there is one; exposure: natural log of the light gathered, up to a
    constant, if the file states it; focal: what the file's metadata tell of the focal length.
    """

    srgb: np.ndarray
    index: int
    time_s: float | None
    source: str
    focal_px: float | None
    done: int
    of: int
    full: np.ndarray | None = None
    exposure: float | None = None
    focal: Focal = Focal()


def evenly(count: int, most: int) -> np.ndarray:
    """Return at most `most` indices of 0 ... count-1 at equal intervals, first and last included."""
    return np.arange(count) if count <= most else np.round(np.linspace(0, count - 1, most)).astype(int)


def evenly_in_time(times: np.ndarray, most: int) -> np.ndarray:
    """Return at most `most` indices of ascending time stamps [N] nearest to equal intervals, first and last included.

    A pause in the recording counts as no more than thirty frames.
    """
    if len(times) <= most:
        return np.arange(len(times))
    steps = np.diff(times.astype(float))
    clock = np.concatenate([[0], np.minimum(steps, 30 * np.median(steps)).cumsum()])
    after = np.clip(np.searchsorted(clock, ticks := np.linspace(0, clock[-1], most)), 1, len(clock) - 1)
    return np.unique(np.where(ticks - clock[after - 1] <= clock[after] - ticks, after - 1, after))


def fitted(width: float, height: float, long_side: int) -> tuple[int, int]:
    """Return width and height shrunk so that the longer one is at most `long_side`; never enlarged."""
    scale = min(1.0, long_side / max(width, height))
    return max(1, round(float(width * scale))), max(1, round(float(height * scale)))


def fit(pixels: np.ndarray, long_side: int) -> np.ndarray:
    """Shrink [H, W, 3] so that its longer side is at most `long_side`; never enlarge."""
    width, height = fitted(pixels.shape[1], pixels.shape[0], long_side)
    return pixels if (height, width) == pixels.shape[:2] else images.resize(pixels, width, height)
