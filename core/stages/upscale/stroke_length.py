# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How long the strokes of hair are that an albedo shows: stubble has strokes hardly longer than wide, a beard long
ones.

Strokes strewn at random have, whatever their number, the autocovariance of a single one (Campbell's theorem): along a
stroke of length L it falls linearly to nothing at L, across it as fast as the picture is sharp. What is grain, shade
and patches is as like itself along as across, so the difference of the two has the strokes alone.
"""

from __future__ import annotations

import cv2
import numpy as np

from .strokes import HairTexels

PATCHES_MM = 3.0
"""mm beyond which a picture's differences are patches and light, no strokes."""
LAGS_MM = np.arange(0.0, 8.01, 0.25)
"""Distances at which texels are compared: beyond 8 mm a beard's hairs part."""
LENGTHS_MM = np.geomspace(0.5, 12.0, 40)
"""Lengths that are tried."""
ROW = 1024
"""Texels in a row of what cv2 takes at once."""


def measure_stroke_length(light: np.ndarray, texels: HairTexels, way: np.ndarray, texel: float) -> float:
    """Length of strokes in mm along the skin; 0 where they are no longer along `way` than across it.

    Parameters
    ----------
    light : [S, S], mean of the log albedo
    texels : the N texels on which the hair grows
    way : [N, 3], how such hair usually lies: ways chosen by the strokes would find some in any grain
    texel : its width in mm
    """
    fine = (light - cv2.GaussianBlur(light, (0, 0), PATCHES_MM / texel)).astype(np.float32)
    inner = _away_from_border(texels.mask, PATCHES_MM / texel)
    flat = texels.flatten(way)[inner[texels.mask]]
    along = _covariances(fine, inner, flat, texel)
    across = _covariances(fine, inner, np.stack([-flat[:, 1], flat[:, 0]], 1), texel)
    excess = along - across
    if np.sum(excess) <= 0:
        return 0.0
    sharp = _half(across)
    shapes = [_excess_of(length, sharp) for length in LENGTHS_MM]
    fits = [(shape @ excess) / np.sqrt(shape @ shape) for shape in shapes]  # the best amplitude each
    return float(LENGTHS_MM[int(np.argmax(fits))])


def _away_from_border(mask: np.ndarray, texels: float) -> np.ndarray:
    """What of a mask [S, S] lies so far within it: nearer, what is beside the hair is among the patches, and the edge
    of a lip would be a long stroke. All of a mask that is nowhere so wide."""
    inside = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    deep = inside > texels
    return deep if deep.any() else mask


def _covariances(fine: np.ndarray, mask: np.ndarray, way: np.ndarray, texel: float) -> np.ndarray:
    """Of the texels with those LAGS_MM along their ways [N, 2], as far as these are masked, too."""
    v, u = np.nonzero(mask)
    own, inside = fine[mask], mask.astype(np.float32)
    found = []
    for lag in LAGS_MM:
        x, y = (_rows(at) for at in (u + lag * way[:, 0] / texel, v - lag * way[:, 1] / texel))
        other, kept = (cv2.remap(picture, x, y, cv2.INTER_LINEAR).ravel()[: len(u)] for picture in (fine, inside))
        kept = kept > 0.99
        found.append(float((own[kept] * other[kept]).mean()) if kept.any() else 0.0)
    return np.array(found)


def _rows(values: np.ndarray) -> np.ndarray:
    return np.resize(values, (-(-len(values) // ROW), ROW)).astype(np.float32)


def _half(across: np.ndarray) -> float:
    """mm within which the covariance across the strokes falls to a half: how sharp the picture is."""
    below = np.flatnonzero(across < across[0] / 2)
    if not len(below):
        return float(LAGS_MM[-1])
    last = below[0]
    return float(np.interp(-across[0] / 2, -across[last - 1 : last + 1], LAGS_MM[last - 1 : last + 1]))


def _excess_of(length: float, sharp: float) -> np.ndarray:
    """The difference at LAGS_MM that strokes of a length have in a picture so sharp, of any size."""
    step = 0.05
    at = np.arange(-16.0, 16.0 + step / 2, step)
    blur = np.exp(-np.log(2) * (at / sharp) ** 2)
    along = np.convolve(np.clip(1 - np.abs(at) / length, 0, None), blur, "same")
    return np.interp(LAGS_MM, at, along / along.max() - blur)
