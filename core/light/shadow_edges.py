# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The soft edge of a shadow: from a rough mask and the texture to an alpha that lies on the penumbra.

The local light is continuous inside M, so a sharp edge of the shadow can live in M alone (the paper's failure case,
section 4.4). Near the painted contour the texture over the reference face is divided into a lit and a dark side (local
two-phase segmentation after Li et al. 2008, "Minimization of region-scalable fitting energy"). The position and width
of the penumbra about that edge are fitted in windows, so that pores and moles average out. Where there is no step, or
one of another colour than the shadow's (a brow, a lip), the painted mask stays. Lengths are texels of a 1024 map.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

INWARD_TEXELS, OUTWARD_TEXELS = 24.0, 6.0  # search range inside and outside the painted contour
BAND_TEXELS = 12.0  # half width of the band about the edge
WINDOW_TEXELS = 11.0  # deviation of the windows in which sides are averaged and profiles fitted
ALONG_TEXELS = 6.0  # deviation over which the penumbra varies along the edge
SHIFTS_TEXELS = (-6.0, -4.0, -2.5, -1.25, 0.0, 1.25, 2.5, 4.0, 6.0)  # candidates for the edge's middle
WIDTHS_TEXELS = (0.0, 2.0, 4.0, 7.0, 10.0, 14.0, 19.0, 25.0)  # candidates for the penumbra's width
STEP_SHARES = 0.06, 0.16  # of the light: a smaller step is no edge, a larger one certainly is
# distance of a step's colour (its three shares over their mean) from the shadow's: below, it is shadow; above, not
COLOUR_DISTANCES = 0.12, 0.30
ROUNDS = 8  # of the segmentation


@dataclass(frozen=True)
class Edge:
    """A shadow's edge.

    alpha [S, S] in [0, 1] is M. on_edge [S, S] in [0, 1] is how surely a texel lies on a visible edge, within
    BAND_TEXELS of it. colour [3] is what the shadow takes of the light, over its mean (zeros: no edge found).
    """

    alpha: np.ndarray
    on_edge: np.ndarray
    colour: np.ndarray


def place(
    light: np.ndarray, painted: np.ndarray, weight: np.ndarray, texel: float, check: Callable[[], None] = lambda: None
) -> Edge:
    """Fit the edge of the shadow under a rough mask.

    light [S, S, 3] is texture over (reference albedo x global shading), linear, about 1 where lit; painted [S, S] in
    [0, 1] the mask, as soft as it shall stay without an edge; weight [S, S] in [0, 1] the trust in a texel (0: unseen,
    or a brow); `texel` its side in texels of a 1024 map. Deeper inside than INWARD_TEXELS + BAND_TEXELS alpha is never
    lowered. `check` may raise to cancel.
    """
    inside = painted > 0.5
    edge = None
    if inside.any() and not inside.all():
        box = _box(inside, (OUTWARD_TEXELS + 3 * WINDOW_TEXELS) / texel)
        crop = np.clip(light[box], 0, 4).astype(np.float32)
        edge = _place(crop, painted[box], weight[box].astype(np.float32), texel, check)
    if edge is None:
        return Edge(painted, np.zeros_like(painted), np.zeros(3))
    whole = Edge(painted.copy(), np.zeros_like(painted), edge.colour)
    whole.alpha[box], whole.on_edge[box] = edge.alpha, edge.on_edge
    return whole


def _place(
    light: np.ndarray, painted: np.ndarray, weight: np.ndarray, texel: float, check: Callable[[], None]
) -> Edge | None:
    depth = signed_distance(painted > 0.5) * texel  # negative inside
    dark = _segmented(light.mean(-1), painted > 0.5, depth, weight, texel)
    if not dark.any() or dark.all():
        return None
    distance = cv2.GaussianBlur(signed_distance(dark), (0, 0), max(1.5 / texel, 0.5)) * texel
    near = weight * (np.abs(distance) < 2.5 * BAND_TEXELS)
    shift, width, step = _profile(light, distance, near, texel, check)
    sure, colour = _sureness(step, near * (np.abs(distance) < BAND_TEXELS))
    if sure is None:
        return None
    # the artist's strokes far from the contour stay
    sure = sure * np.clip((INWARD_TEXELS + BAND_TEXELS - np.abs(depth + INWARD_TEXELS / 2)) / BAND_TEXELS, 0, 1)
    fitted = penumbra(distance - shift, np.maximum(width, 0.7 * texel))
    alpha = painted + sure * (fitted - painted)
    alpha = np.where(depth < -INWARD_TEXELS - BAND_TEXELS, painted, alpha)
    return Edge(alpha.astype(np.float32), (sure * (np.abs(distance) < BAND_TEXELS)).astype(np.float32), colour)


def penumbra(distance: np.ndarray, width: np.ndarray) -> np.ndarray:
    """Return the blocked share of a light at a signed distance from the edge's middle (positive: lit side)."""
    t = np.clip(0.5 - distance / np.maximum(width, 1e-3), 0, 1)
    return t * t * (3 - 2 * t)


def _segmented(
    light: np.ndarray, inside: np.ndarray, depth: np.ndarray, weight: np.ndarray, texel: float
) -> np.ndarray:
    """Segment the dark side, bool [h, w]: both sides' local means and the sides themselves are updated in turn.

    Deep inside the mask all is dark.
    """
    sigma, smooth = WINDOW_TEXELS / texel, max(2.0 / texel, 0.6)
    free = (depth > -INWARD_TEXELS) & (depth < OUTWARD_TEXELS)
    dark = inside.astype(np.float32)
    for _ in range(ROUNDS):
        means = []
        for side in (1 - dark, dark):
            share = side * weight
            means.append(_blur(light * share, sigma) / np.maximum(_blur(share, sigma), 1e-4))
        lit, shaded = means
        gap = lit - shaded
        odds = np.where(
            gap > 0.02, ((lit + shaded) / 2 - light) / np.maximum(gap, 0.05), np.where(dark > 0.5, 0.5, -0.5)
        )
        trust = np.maximum(weight, 0.02)
        odds = _blur(np.clip(odds, -0.5, 0.5) * trust, smooth) / np.maximum(_blur(trust, smooth), 1e-4)
        dark = np.where(free, odds > 0, inside).astype(np.float32)
    return dark > 0.5


def _profile(
    light: np.ndarray, distance: np.ndarray, weight: np.ndarray, texel: float, check: Callable[[], None]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fit place [h, w], width [h, w] and the step's height [h, w, 3] of the penumbra in the window about each texel.

    In a window light = lit - step * penumbra(distance - place, width): linear in lit and step, so that each candidate's
    residual has a closed form.
    """
    sigma = WINDOW_TEXELS / texel
    value = light.mean(-1)
    total = np.maximum(_blur(weight, sigma), 1e-4)
    mean, square = _blur(weight * value, sigma) / total, _blur(weight * value**2, sigma) / total
    variance = np.maximum(square - mean**2, 1e-8)
    best, shift, width = np.full(value.shape, np.inf, np.float32), np.zeros_like(value), np.zeros_like(value)
    for w in WIDTHS_TEXELS:
        for p in SHIFTS_TEXELS:
            check()
            shape = penumbra(distance - p, np.float32(max(w, 0.7 * texel))).astype(np.float32)
            m = _blur(weight * shape, sigma) / total
            spread = np.maximum(_blur(weight * shape**2, sigma) / total - m**2, 1e-5)
            covariance = _blur(weight * shape * value, sigma) / total - m * mean
            rest = 1 - np.minimum(covariance, 0) ** 2 / (spread * variance)
            better = rest < best
            best, shift, width = np.where(better, rest, best), np.where(better, p, shift), np.where(better, w, width)
    share = weight * (np.abs(distance) < BAND_TEXELS) * np.clip(1 - best, 0.01, 1)
    along = np.maximum(_blur(share, ALONG_TEXELS / texel), 1e-5)
    shift, width = (_blur(each * share, ALONG_TEXELS / texel) / along for each in (shift, width))
    shape = penumbra(distance - shift, np.maximum(width, 0.7 * texel)).astype(np.float32)
    m = _blur(weight * shape, sigma) / total
    spread = np.maximum(_blur(weight * shape**2, sigma) / total - m**2, 1e-3)
    steps = [
        (_blur(weight * shape * c, sigma) / total - m * (_blur(weight * c, sigma) / total)) / spread
        for c in np.moveaxis(light, -1, 0)
    ]
    return shift, width, -np.stack(steps, -1)


def _sureness(step: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray | None, np.ndarray]:
    """Return how surely [h, w] a step [h, w, 3] is one, of the colour of most of the edge, and that colour [3].

    None if there is no step.
    """
    height = step.mean(-1)
    good = (weight > 0.5) & (height > STEP_SHARES[1])
    if good.sum() < 8:
        return None, np.zeros(3)
    colour = np.median(step[good] / height[good][:, None], axis=0)
    unlike = np.abs(step / np.maximum(height, 0.05)[..., None] - colour).max(-1)
    sure = _ramp(height, *STEP_SHARES) * (1 - _ramp(unlike, *COLOUR_DISTANCES))
    return sure.astype(np.float32), colour


def _ramp(x: np.ndarray, low: float, high: float) -> np.ndarray:
    return np.clip((x - low) / (high - low), 0, 1)


def signed_distance(inside: np.ndarray) -> np.ndarray:
    """Return texels to the border of a region, negative inside; the border runs between texels."""
    outside = cv2.distanceTransform((~inside).astype(np.uint8), cv2.DIST_L2, 5)
    depth = cv2.distanceTransform(inside.astype(np.uint8), cv2.DIST_L2, 5)
    return np.where(inside, 0.5 - depth, outside - 0.5).astype(np.float32)


def _blur(image: np.ndarray, sigma: float) -> np.ndarray:
    return cv2.GaussianBlur(image, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)


def _box(inside: np.ndarray, margin: float) -> tuple[slice, slice]:
    rows, columns = np.flatnonzero(inside.any(1)), np.flatnonzero(inside.any(0))
    reach = int(np.ceil(margin))
    return tuple(slice(max(int(i[0]) - reach, 0), int(i[-1]) + 1 + reach) for i in (rows, columns))
