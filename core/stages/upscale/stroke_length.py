# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the length of hair's strokes in an albedo: stubble has strokes hardly longer than wide, a beard long ones.

Strokes strewn at random have, whatever their number, the autocovariance of a single one (Campbell's theorem): along a
stroke of length L it falls linearly to nothing at L, across it as fast as the picture is sharp. Grain, shade and
patches are as like themselves along as across, so the difference of the two has the strokes alone.
"""

from __future__ import annotations

import cv2
import numpy as np

from .strokes import HairTexels

PATCHES_MM = 3.0  # larger differences are patches and light, no strokes
LAGS_MM = np.arange(0.0, 8.01, 0.25)  # distances of texels that are compared: beyond 8 mm a beard's hairs part
LENGTHS_MM = np.geomspace(0.5, 12.0, 40)  # that are tried
ROW = 1024  # texels in a row that cv2 takes at once


def measure_stroke_length(light: np.ndarray, texels: HairTexels, way: np.ndarray, texel: float) -> float:
    """Return the length of strokes in mm along the skin; 0 if they are no longer along `way` than across it.

    light [S, S]: mean of the log albedo; way [N, 3]: how such hair usually lies on the texels, each `texel` mm wide:
    ways chosen by the strokes would find some in any grain.
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
    """Return the part of a mask [S, S] so far within it, or all of a mask that is nowhere so wide."""
    inside = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    deep = inside > texels
    return deep if deep.any() else mask


def _covariances(fine: np.ndarray, mask: np.ndarray, way: np.ndarray, texel: float) -> np.ndarray:
    """Return the covariances of texels with those LAGS_MM along their ways [N, 2], as far as these are masked, too."""
    v, u = np.nonzero(mask)
    own, inside = fine[mask], mask.astype(np.float32)
    covariances = []
    for lag in LAGS_MM:
        x, y = (_rows(at) for at in (u + lag * way[:, 0] / texel, v - lag * way[:, 1] / texel))
        other, kept = (cv2.remap(picture, x, y, cv2.INTER_LINEAR).ravel()[: len(u)] for picture in (fine, inside))
        kept = kept > 0.99
        covariances.append(float((own[kept] * other[kept]).mean()) if kept.any() else 0.0)
    return np.array(covariances)


def _rows(values: np.ndarray) -> np.ndarray:
    return np.resize(values, (-(-len(values) // ROW), ROW)).astype(np.float32)


def _half(across: np.ndarray) -> float:
    """Return the mm within which the covariance across the strokes falls to a half: how sharp the picture is."""
    below = np.flatnonzero(across < across[0] / 2)
    if not len(below):
        return float(LAGS_MM[-1])
    last = below[0]
    return float(np.interp(-across[0] / 2, -across[last - 1 : last + 1], LAGS_MM[last - 1 : last + 1]))


def _excess_of(length: float, sharp: float) -> np.ndarray:
    """Return the difference at LAGS_MM of strokes of a length in a picture so sharp, of any size."""
    step = 0.05
    at = np.arange(-16.0, 16.0 + step / 2, step)
    blur = np.exp(-np.log(2) * (at / sharp) ** 2)
    along = np.convolve(np.clip(1 - np.abs(at) / length, 0, None), blur, "same")
    return np.interp(LAGS_MM, at, along / along.max() - blur)
