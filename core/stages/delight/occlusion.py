# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pixels of a frame the sun reaches: two possible shadings, one picture.

Away from the edges of shadows the share of the sun is 0 or 1 and the skin's detail is untouched; in a band along them
it is what the pixel's colour asks for, given the albedo on both sides, so that a penumbra or a blurred edge leaves no
halo.
"""

from __future__ import annotations

import cv2
import numpy as np

from ...light.sunlight import log_likelihood

ALBEDO_SHARE = 0.03  # scale over which skin's albedo is taken for even, as a share of the frame's longer side
COHERENCE_LOG_ODDS = 3.0  # weight of the neighbourhood's opinion, in log odds
BAND_SHARE = 0.004  # half width of the band along an edge
ZONE_SHARE = 0.008  # and of the zone about it that must be no darker or lighter than its surroundings
FINE_SHARE = 0.0025  # skin's detail below this scale is kept even there


def estimate_sun_share(
    linear: np.ndarray,
    ambient: np.ndarray,
    direct: np.ndarray,
    free: np.ndarray,
    skin: np.ndarray,
    head: np.ndarray,
    side: int,
) -> np.ndarray:
    """How much of the sun each pixel gets.

    Parameters
    ----------
    linear : [H, W, 3], the frame, linear
    ambient, direct : [H, W, 3], linear: the skin's colour under the sky, and what the sun would add
    free : [H, W] in [0, 1], 1 where the head itself leaves the sun visible
    skin : [H, W] in [0, 1], 0 on brows, lips and hair, whose darkness is their own
    head : bool [H, W]
    side : the longer side in pixels of the frame that this is a part of

    Returns
    -------
    [H, W] in [0, 1].
    """
    log = np.log(np.maximum(linear, 1e-3)).astype(np.float32)
    shaded = np.log(np.maximum(ambient, 1e-4)).astype(np.float32)
    sunlit = np.log(np.maximum(ambient + direct, 1e-4)).astype(np.float32)
    prior = _log_odds(0.05 + 0.6 * cv2.GaussianBlur(free.astype(np.float32), (0, 0), 0.004 * side))
    albedo = np.zeros_like(log)
    share = np.full(head.shape, 0.5, np.float32)
    for _ in range(6):
        evidence = (
            skin * np.clip(log_likelihood(log - sunlit - albedo) - log_likelihood(log - shaded - albedo), -12, 12)
            + prior
        )
        for _ in range(4):
            around = _mean_over(share, head, 0.004 * side)
            odds = np.clip(evidence + COHERENCE_LOG_ODDS * (2 * around - 1), -30, 30)
            share = (1 / (1 + np.exp(-odds))).astype(np.float32)
        sharp = (share > 0.5)[..., None]
        deviation = np.clip(log - np.where(sharp, sunlit, shaded), -0.8, 0.8)
        albedo = _mean_over(deviation, head, ALBEDO_SHARE * side)
    return _soften(
        (share > 0.5) & head, log, np.where(sharp, sunlit, shaded), ambient, direct, head, max(1.5, BAND_SHARE * side)
    )


def remove_seams(
    log_albedo: np.ndarray, share: np.ndarray, head: np.ndarray, zone_px: float, fine_px: float
) -> np.ndarray:
    """What to take from a log albedo along the edges of a shadow so that no outline of it stays.

    Bounces, subsurface light and the video's chroma make a penumbra that one share cannot explain. Near an edge the
    coarse part of the albedo is carried over from both sides; its fine part stays. As far as the share does not change
    across an edge, nothing is taken: there may be none.

    Parameters
    ----------
    log_albedo : [H, W, 3], natural log of linear values
    share : [H, W] in [0, 1], of the sun
    head : bool [H, W], where the albedo is that of skin
    zone_px : half width of the zone about an edge that must be no darker or lighter than its surroundings
    fine_px : deviation below which detail is the skin's own

    Returns
    -------
    [H, W, 3], natural log.
    """
    lit = (share > 0.5).astype(np.uint8)
    distance = cv2.distanceTransform(lit, cv2.DIST_L2, 5) + cv2.distanceTransform(1 - lit, cv2.DIST_L2, 5)
    sure = head & (distance > zone_px)
    known = cv2.GaussianBlur(sure.astype(np.float32), (0, 0), 0.7 * zone_px)
    excess = _mean_over(log_albedo, head, fine_px) - _mean_over(log_albedo, sure, 0.7 * zone_px)
    # the share is blurred as far as the zone reaches, so its two levels lie beyond
    about = np.ones((2 * max(1, round(1.5 * zone_px)) + 1,) * 2, np.uint8)
    step = np.clip(cv2.dilate(share, about) - cv2.erode(share, about), 0, 1)
    ramp = np.clip(2 * (1 - distance / zone_px), 0, 1) * np.clip(known / 0.05, 0, 1) * step * head
    return np.clip(excess, -0.7, 0.7) * ramp[..., None]


def _soften(lit: np.ndarray, log, log_light, ambient, direct, head, band: float) -> np.ndarray:
    """The hard decision `lit` with its edges solved for: least squares of colour = albedo * (ambient + share *
    direct)."""
    inner = cv2.distanceTransform(lit.astype(np.uint8), cv2.DIST_L2, 3)
    outer = cv2.distanceTransform((~lit).astype(np.uint8), cv2.DIST_L2, 3)
    edge = (inner + outer <= band + 0.5) & head
    sure = head & ~edge
    albedo = np.exp(_mean_over(log - log_light, sure, 2 * band))
    near, far = ambient * albedo, direct * albedo
    share = ((np.exp(log) - near) * far).sum(-1) / np.maximum((far * far).sum(-1), 1e-8)
    return np.where(edge, np.clip(share, 0, 1), lit).astype(np.float32)


def _mean_over(image: np.ndarray, mask: np.ndarray, sigma: float) -> np.ndarray:
    """Gaussian mean of [H, W(, C)] over the pixels `mask`; a wide one at a quarter of the size."""
    if sigma > 12:
        height, width = mask.shape
        small = (max(width // 4, 1), max(height // 4, 1))
        weight = cv2.resize(mask.astype(np.float32), small, interpolation=cv2.INTER_AREA)
        total = cv2.resize(
            np.asarray(image * (mask if image.ndim == 2 else mask[..., None]), np.float32),
            small,
            interpolation=cv2.INTER_AREA,
        )
        norm = np.maximum(cv2.GaussianBlur(weight, (0, 0), sigma / 4), 1e-4)
        mean = cv2.GaussianBlur(total, (0, 0), sigma / 4) / (norm if image.ndim == 2 else norm[..., None])
        return cv2.resize(mean, (width, height), interpolation=cv2.INTER_LINEAR)
    weight = mask.astype(np.float32)
    total = cv2.GaussianBlur(
        np.asarray(image * (weight if image.ndim == 2 else weight[..., None]), np.float32), (0, 0), sigma
    )
    norm = np.maximum(cv2.GaussianBlur(weight, (0, 0), sigma), 1e-4)
    return total / (norm if image.ndim == 2 else norm[..., None])


def _log_odds(share: np.ndarray) -> np.ndarray:
    return np.log(share / (1 - share))
