# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Alignment: a smooth warp of each view's UV texture onto the others' consensus, against pose and surface errors.

After Zhou and Koltun, "Color Map Optimization for 3D Reconstruction with Consumer Depth Cameras" (2014), with dense
optical flow (DIS) in UV space in the place of their control lattice.
"""

from __future__ import annotations

import cv2
import numpy as np

from ...capture.messages import Reporter
from ...face.head import Unfolded
from ...geometry import raster
from ...geometry.views import lengths
from .blend import blurred, weighted_mean
from .projection import UnwrappedView

ROUNDS = 2
LARGEST_WARP_SHARE = 10 / 1024  # longest warp, share of the map's side
SMOOTH_SIDE_SHARE = 24 / 1024  # Gaussian sigma of the warp's smoothing, share of the map's side


def align(observations: list[UnwrappedView], surface: Unfolded, report: Reporter) -> float:
    """Resample every observation along its warp; return the mean length of the warps in texels, where they count."""
    if len(observations) < 2:
        return 0.0
    size = len(surface.covered)
    for observation in observations:
        observation.pixels = raster.bleed(observation.pixels, surface.covered)
    warps = [np.zeros((size, size, 2), np.float32) for _ in observations]
    total = len(observations) + 6
    for step in range(ROUNDS):
        details = [_detail(o) for o in observations]
        consensus = weighted_mean(details, (o.weight**3 for o in observations))
        for i, observation in enumerate(observations):
            report.progress(
                total - 6 + (step * len(observations) + i) / len(observations), total, f"aligning {observation.name}"
            )
            warps[i] += _flow(consensus, details[i], observation.weight)
        del details
        drift = weighted_mean(warps, (o.weight for o in observations))
        for warp, observation in zip(warps, observations, strict=True):
            report.check()
            warp -= drift  # the views may move against each other, not the texture over the surface
            warp *= np.minimum(1, LARGEST_WARP_SHARE * size / np.maximum(lengths(warp)[..., None], 1e-6))
            observation.resample(_moved(observation.pixels, warp), warp if step == ROUNDS - 1 else None)
    moved = [lengths(warp)[o.weight > 0.25 * o.weight.max()] for warp, o in zip(warps, observations, strict=True)]
    return float(np.concatenate(moved).mean())


def align_to(observation: UnwrappedView, log_texture: np.ndarray, observed: np.ndarray, surface: Unfolded) -> None:
    """Resample one observation along its warp onto a texture, natural log [S, S, 3], where that was observed [S, S]."""
    size = len(surface.covered)
    observation.pixels = raster.bleed(observation.pixels, surface.covered)
    consensus = _band(log_texture.mean(-1), observed)
    warp = np.zeros((size, size, 2), np.float32)
    for step in range(ROUNDS):
        warp += _flow(consensus, _detail(observation), observation.weight)
        warp *= np.minimum(1, LARGEST_WARP_SHARE * size / np.maximum(lengths(warp)[..., None], 1e-6))
        observation.resample(_moved(observation.pixels, warp), warp if step == ROUNDS - 1 else None)


def _detail(observation: UnwrappedView) -> np.ndarray:
    return _band(observation.log_colour.mean(-1), observation.weight > 0)


def _band(grey: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Return the band-passed log luminance [S, S], which can be matched whatever the light."""
    observed, size = (seen > 0).astype(np.float32), len(grey)
    return (blurred(grey, observed, size / 1024) - blurred(grey, observed, 10 * size / 1024)) * observed


def _flow(consensus: np.ndarray, detail: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return smooth float32 [S, S, 2] with consensus(x) = detail(x + flow(x)).

    It is decided where the view sees well and there is something to match.
    """
    trust = np.clip(weight / max(np.percentile(weight[weight > 0], 80) if (weight > 0).any() else 1, 1e-9), 0, 1)
    spread = max(float(consensus[trust > 0.2].std()) if (trust > 0.2).any() else 0.0, 1e-4)
    first, second = (
        (128 + 127 * np.tanh(trust * image / (3 * spread))).astype(np.uint8) for image in (consensus, detail)
    )
    dis = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    dis.setFinestScale(1)
    flow = dis.calc(first, second, None)
    contrast = cv2.GaussianBlur(np.abs(consensus), (0, 0), 6 * (len(consensus) / 1024)) / spread
    sure = trust * np.minimum(contrast, 2) + 1e-4
    return blurred(flow, sure, SMOOTH_SIDE_SHARE * len(consensus)).astype(np.float32)


def _moved(pixels: np.ndarray, warp: np.ndarray) -> np.ndarray:
    """Return pixels(x + warp(x)): where the picture shows what belongs at texel x."""
    y, x = np.mgrid[0 : len(warp), 0 : len(warp)].astype(np.float32)
    return cv2.remap(pixels, x + warp[..., 0], y + warp[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
