# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Moles and round scars in the texture, which a grid of small lights would take for shadow.

The paper's supplement has the case: "nevus ... close to the grid size". They are blobs of the Laplacian's scale space
(Lindeberg 1998) that are compact, darker than everything around them, alone, and of another colour than the shadow:
melanin and blood absorb blue and green, a shadow lacks what the sun gave. Longer scars are not found. Lengths are
texels of a 1024 map.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch

from ..evidence import Evidence

RADII_TEXELS = tuple(np.geomspace(2.0, 8.0, 6))  # of the blobs that are looked for
DISC_RESPONSE = 2 / np.e  # of a disc's contrast, what the normalised Laplacian of deviation radius / sqrt 2 has amid it
MIN_CONTRAST_LOG = 0.3  # contrast, natural log units: a fainter one is a freckle, or nothing
# of the usual response of such a blob within that distance: in stubble and on rough skin more is asked for
STANDING_OUT_RATIO, STANDING_OUT_TEXELS = 4.5, 32.0
MIN_COMPACTNESS = 0.45  # least ratio of the two curvatures: an edge has 0, a disc 1
MIN_SURROUNDED_SHARE = 0.45  # of the contrast that every direction must show
# more others of that share of its contrast, within that distance, make it one of a crowd of freckles
MAX_NEIGHBOURS, NEIGHBOUR_REACH_TEXELS, LIKE_SHARE = 2, 64.0, 0.4
MIN_COLOUR_DISTANCE = 0.16  # distance of a mark's colour from the shadow's, in shares of its contrast
SECTORS = 8  # around a mark in which its surroundings are compared
FEATURE_MARGIN_TEXELS = 12.0  # distance to brows, lips, lids, nostrils and scalp


@dataclass(frozen=True)
class Mark:
    """Mark, with row, column and radius in texels of the map; change [3]: ln R, G, B against the surroundings."""

    row: float
    column: float
    radius: float
    change: tuple[float, float, float]

    @property
    def contrast(self) -> float:
        return -sum(self.change) / 3


@dataclass(frozen=True)
class _Blob:
    """Maximum of the scale space, in texels of the map; strength: the contrast it would have as a disc."""

    row: int
    column: int
    radius: float
    strength: float
    stands_out: bool


def protect_marks(
    evidence: Evidence, witness: Callable[[list[Mark]], list[Mark]] = list
) -> tuple[Evidence, list[Mark]]:
    """Return the evidence without trust in the marks inside M that `witness` confirms, and those marks."""
    if not (evidence.alpha > 0).any():
        return evidence, []
    feature = cv2.blur(1 - evidence.trust.numpy(), (2 * round(FEATURE_MARGIN_TEXELS / evidence.texel) + 1,) * 2)
    where = (evidence.skin.numpy() > 0.5) & (evidence.weight.numpy() > 0.5) & (feature < 0.02)
    alpha, colour = evidence.alpha.numpy(), np.array(evidence.shadow_colour)
    marks = find_marks(evidence.texture.permute(1, 2, 0).numpy(), where, evidence.texel)
    in_shadow = [mark for mark in marks if alpha[round(mark.row), round(mark.column)] > 0.05]
    marks = witness([mark for mark in in_shadow if is_unlike_shadow(mark, colour)])
    cover = torch.from_numpy(draw_cover(marks, evidence.size, evidence.texel))
    return replace(evidence, trust=evidence.trust * (1 - cover)), marks


def find_marks(texture: np.ndarray, skin: np.ndarray, texel: float) -> list[Mark]:
    """Find the marks of a linear texture [S, S, 3] on bool [S, S] seen skin without features, darkest first."""
    if not skin.any():
        return []
    log = np.log(np.maximum(texture, 1e-3)).astype(np.float32)
    log = _bled(log, skin)  # so that the border of what is not skin is no blob
    blobs = _find_blobs(log.mean(-1), skin, texel)
    measured = [_measure(log, blob) for blob in blobs if blob.stands_out]
    kept: list[Mark] = []
    for mark in sorted(filter(None, measured), key=lambda mark: -mark.contrast):
        if all(_distance(mark, other) > mark.radius + other.radius for other in kept):
            kept.append(mark)
    return [mark for mark in kept if _is_alone(mark, blobs, NEIGHBOUR_REACH_TEXELS / texel)]


def is_unlike_shadow(mark: Mark, shadow_colour: np.ndarray) -> bool:
    """Return true if a mark has another colour than a shadow that dark.

    shadow_colour [3] is the light's share that shadows take, over its mean (zeros: unknown, taken for grey).
    """
    shadow_colour = shadow_colour if np.any(shadow_colour) else np.ones(3)
    change = np.array(mark.change)
    share = 1 - np.exp(change.mean())
    shadow = np.log(np.maximum(1 - shadow_colour * share, 0.02))
    distance = float(np.abs((change - change.mean()) - (shadow - shadow.mean())).max())
    return distance > MIN_COLOUR_DISTANCE * mark.contrast


def draw_cover(marks: Sequence[Mark], size: int, texel: float) -> np.ndarray:
    """Draw [size, size]: 1 on the marks and a little around them, fading over a texel or two."""
    out = np.zeros((size, size), np.float32)
    row, column = np.mgrid[:size, :size]
    for mark in marks:
        distance = np.hypot(row - mark.row, column - mark.column)
        reach = 1.3 * mark.radius + 1.5 / texel
        np.maximum(out, np.clip(1.5 + reach - distance, 0, 1), out=out)
    return out


def _bled(image: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Give every texel of [S, S, C] that is not `known` the value of the nearest that is."""
    _, labels = cv2.distanceTransformWithLabels(
        (~known).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    return image[known][labels - 1]  # known texels are numbered from 1, row by row


def _find_blobs(log_luminance: np.ndarray, skin: np.ndarray, texel: float) -> list[_Blob]:
    """Find dark blobs of [S, S]: maxima of the normalised Laplacian over place and scale with two like curvatures."""
    radii = [r / texel for r in RADII_TEXELS if r / texel >= 0.9]
    responses, compact, usual = [], [], []
    inside, window = skin.astype(np.float32), (2 * round(STANDING_OUT_TEXELS / texel) + 1,) * 2
    share = np.maximum(cv2.blur(inside, window, borderType=cv2.BORDER_REPLICATE), 1e-3)
    for radius in radii:
        sigma = radius / 2**0.5
        smooth = cv2.GaussianBlur(log_luminance, (0, 0), sigma)
        xx, yy, xy = (cv2.filter2D(smooth, -1, kernel) for kernel in _CURVATURES)
        mean, spread = (xx + yy) / 2, np.sqrt(((xx - yy) / 2) ** 2 + xy**2)
        responses.append(sigma**2 * (xx + yy) / DISC_RESPONSE)
        power = cv2.blur(inside * responses[-1] ** 2, window, borderType=cv2.BORDER_REPLICATE)
        usual.append(np.sqrt(np.maximum(power, 0) / share))
        compact.append((mean - spread) / np.maximum(mean + spread, 1e-9))
    stack = np.stack(responses)
    highest = np.stack([cv2.dilate(r, np.ones((3, 3))) for r in responses])
    around = highest.copy()
    around[1:] = np.maximum(around[1:], highest[:-1])
    around[:-1] = np.maximum(around[:-1], highest[1:])
    stands_out = (stack > 0.7 * MIN_CONTRAST_LOG) & (stack > STANDING_OUT_RATIO * np.stack(usual))
    is_blob = (stack >= around) & (stack > LIKE_SHARE * MIN_CONTRAST_LOG) & (np.stack(compact) > MIN_COMPACTNESS)
    peaks = np.nonzero(is_blob & skin[None])
    return [
        _Blob(r, c, radii[k], float(stack[k, r, c]), bool(stands_out[k, r, c]))
        for k, r, c in zip(*(i.tolist() for i in peaks), strict=True)
    ]


_CURVATURES = tuple(
    np.array(k, np.float32)
    for k in (
        [[0, 0, 0], [1, -2, 1], [0, 0, 0]],
        [[0, 1, 0], [0, -2, 0], [0, 1, 0]],
        [[0.25, 0, -0.25], [0, 0, 0], [-0.25, 0, 0.25]],
    )
)


def _measure(log: np.ndarray, blob: _Blob) -> Mark | None:
    """Return the mark at a blob of the map's logarithm [S, S, 3]; None if some direction around it is as dark."""
    row, column, radius = blob.row, blob.column, blob.radius
    reach = int(np.ceil(2.7 * radius + 1))
    if min(row, column) < reach or max(row, column) >= len(log) - reach:
        return None
    patch = log[row - reach : row + reach + 1, column - reach : column + reach + 1]
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    distance, sector = np.hypot(x, y), np.floor((np.arctan2(y, x) / (2 * np.pi) % 1) * SECTORS).astype(int)
    disc = np.median(patch[distance <= max(0.6 * radius, 0.5)], 0)
    ring = (distance > 1.5 * radius + 0.5) & (distance <= max(2.5 * radius, 1.5 * radius + 2))
    parts = [patch[ring & (sector == k)] for k in range(SECTORS)]
    sides = np.stack([np.median(part, 0) for part in parts if len(part)])
    change = disc - np.median(sides, 0)
    contrast = -change.mean()
    if contrast < MIN_CONTRAST_LOG or (sides.mean(-1) - disc.mean()).min() < MIN_SURROUNDED_SHARE * contrast:
        return None
    return Mark(float(row), float(column), float(radius), tuple(float(v) for v in change))


def _distance(a: Mark, b: Mark | _Blob) -> float:
    return float(np.hypot(a.row - b.row, a.column - b.column))


def _is_alone(mark: Mark, blobs: list[_Blob], reach: float) -> bool:
    """Return true if few similar blobs are nearby."""
    near = [blob for blob in blobs if 2 * mark.radius < _distance(mark, blob) < reach]
    return sum(blob.strength > LIKE_SHARE * mark.contrast for blob in near) <= MAX_NEIGHBOURS
