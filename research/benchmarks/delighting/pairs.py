# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of synthetic portraits that differ in the pigment alone, or in the light alone, for measures/slopes.py.

The second pigment is the first times blotches of several sizes, from a mole's to a cheek's, unlike any skin: what tells
pigment from light may not be that it knows faces. Subjects are those of
research/benchmarks/delighting/delight_portraits.py, which no training sees.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from core.imaging import images

from ...people.portrait import Portrait, relight_sight
from ...people.sight import Sight
from .delight_portraits import portrait_parts

SCALES = (0.006, 0.02, 0.06)
"""Deviations of the blur of white noise that makes the blotches, as shares of the picture's side."""
DEVIATION = 0.16
"""Of the logarithm of each scale's blotches; a tenth of it is colour."""
LIT = 0.01, 0.95
"""Linear levels of pixels that count: below is noise, above is clipped."""


@dataclass(frozen=True)
class Pair:
    """Two portraits, sRGB [S, S, 3], with their true linear albedos [S, S, 3].

    kind: the difference, "pigment" or "light"; where: bool [S, S], facial skin neither black nor clipped in both.
    """

    name: str
    kind: str
    group: str
    pictures: tuple[np.ndarray, np.ndarray]
    albedos: tuple[np.ndarray, np.ndarray]
    where: np.ndarray


def pairs(subjects: dict[str, list[int]], size: int = 384) -> Iterator[Pair]:
    """Yield one pair of each kind per subject; subjects: group -> seeds."""
    for group, seeds in subjects.items():
        for seed in seeds:
            stage, sight = portrait_parts(seed, size)
            first = relight_sight(sight, stage, np.random.default_rng([seed, 41, 0]))
            other = relight_sight(sight, stage, np.random.default_rng([seed, 41, 1]))
            blotched = sight.albedo * blotches(sight, np.random.default_rng([seed, 45]))
            blotched = np.clip(blotched, 0.003, 0.9).astype(np.float32)
            painted = relight_sight(sight, stage, np.random.default_rng([seed, 41, 0]), albedo=blotched)
            yield _pair(seed, "pigment", group, first, painted)
            yield _pair(seed, "light", group, first, other)


def blotches(sight: Sight, rng: np.random.Generator) -> np.ndarray:
    """Return log-normal factors [P, 3] about 1 of all SCALES at the pixels of a sight."""
    total = np.zeros((sight.size, sight.size, 3), np.float32)
    for scale in SCALES:
        for channels, deviation in ((1, DEVIATION), (3, 0.1 * DEVIATION)):
            noise = cv2.GaussianBlur(
                rng.standard_normal((sight.size, sight.size, channels)).astype(np.float32), (0, 0), scale * sight.size
            )
            total += deviation * (noise / noise.std()).reshape(sight.size, sight.size, channels)
    return np.exp(total.reshape(-1, 3)[sight.pixel])


def _pair(seed: int, kind: str, group: str, first: Portrait, second: Portrait) -> Pair:
    skin = cv2.erode((np.minimum(first.skin, second.skin) > 0.9).astype(np.uint8), np.ones((5, 5))) > 0
    levels = np.stack([images.srgb_to_linear(each.srgb) for each in (first, second)])
    lit = (levels.min((0, 3)) > LIT[0]) & (levels.max((0, 3)) < LIT[1])
    return Pair(f"{seed} {kind}", kind, group, (first.srgb, second.srgb), (first.albedo, second.albedo), skin & lit)
