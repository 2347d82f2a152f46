# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Exposure and white balance that a phone changed while filming: one gain per frame and channel.

The same spots are found in neighbouring frames (SIFT; Lowe 2004) and their colours compared, on the person and behind.
A gain is accepted only if it explains most of the picture: a head that turns into the shade changes more on one side,
and its background not at all.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ...face import faces
from ...imaging import images

WIDTH_PX = 480
"""Longer side of the pictures compared: fine detail and noise are gone, motion blur hardly matters."""
SPOT_PX = 9
"""Side of the square over which a spot's colour is averaged."""
STEPS_FRAMES = (1, 2, 5, 12)
"""Distances of compared frames: near ones are accurate, far ones keep small errors from adding up."""
LEAST_SPOTS, LEAST_SHARE = 16, 0.5
"""Minimum number and share of spots that agree with a gain."""
TOLERANCE_LOG = 0.08
"""Deviation from the common gain up to which a spot agrees, in natural log units (8 %)."""
DOUBT_WEIGHT = 0.2
"""Weight of a comparison that may be shading: it counts as no change."""
STEADY_LOG = 0.08
"""Range of the gains, in natural log units, up to which no picture is changed: that of a steady video of 100 frames.
The texture evens out what is smaller."""


@dataclass(frozen=True)
class Content:
    """Spots of a frame: descriptors uint8 [n, 128], log_colour float32 [n, 3] (linear light), place float32 [n, 2].

    place is in pixels of the small picture; person bool [n]: on the person.
    """

    descriptors: np.ndarray
    log_colour: np.ndarray
    place: np.ndarray
    person: np.ndarray


def content_of(srgb: np.ndarray) -> Content:
    """Return the spots of a frame, sRGB [H, W, 3], that are neither clipped nor black."""
    scale = WIDTH_PX / max(srgb.shape[:2])
    small = images.resize(srgb, round(srgb.shape[1] * scale), round(srgb.shape[0] * scale))
    grey = np.clip(images.luma(small) * 255, 0, 255).astype(np.uint8)
    points, descriptors = cv2.SIFT_create(600, contrastThreshold=0.015).detectAndCompute(grey, None)
    if not points:
        return Content(*(np.zeros((0, width), np.float32) for width in (128, 3, 2)), np.zeros(0, bool))
    x, y = np.array([p.pt for p in points]).round().astype(int).T
    x, y = np.clip(x, 0, small.shape[1] - 1), np.clip(y, 0, small.shape[0] - 1)
    mean = cv2.blur(images.srgb_to_linear(small), (SPOT_PX, SPOT_PX))[y, x]
    whole = np.ones((SPOT_PX, SPOT_PX), np.uint8)
    fair = (cv2.dilate(small.max(-1), whole)[y, x] < 0.97) & (mean.min(-1) > 0.004)
    person = faces.segment_person(small)[y, x] > 0.5
    return Content(
        descriptors.astype(np.uint8)[fair],
        np.log(np.maximum(mean, 1e-5))[fair],
        np.stack([x, y], 1)[fair].astype(np.float32),
        person[fair],
    )


@dataclass(frozen=True)
class Link:
    """Comparison of two frames: gain [3], the log of the second's light over the first's, and its weight.

    person: nothing but the person could be compared; shading: the change is shading rather than exposure.
    """

    gain: np.ndarray
    weight: float
    person: bool = False
    shading: bool = False


def gains_of(contents: list[Content], check=lambda: None) -> np.ndarray:
    """Return factors [N, 3] in linear light that even the frames out, 1 for the median frame.

    Exactly 1 throughout if the light is steady. `check` is called between comparisons.
    """
    count = len(contents)
    turning = np.zeros(count, bool)
    pairs, links = [], []
    # far ones first: shading shows over a wide turn, not from one frame to the next
    for step in sorted(STEPS_FRAMES, reverse=True):
        for i in range(count - step):
            check()
            link = compare(contents[i], contents[i + step])
            if link is None:
                continue
            turning[i : i + step] |= link.shading
            if link.shading or (link.person and turning[i : i + step].any()):
                link = Link(np.zeros(3), DOUBT_WEIGHT * link.weight)
            pairs.append((i, i + step))
            links.append(link)
    if not links:
        return np.ones((count, 3))
    ratios, weights = np.array([link.gain for link in links]), np.array([link.weight for link in links])
    levels = _levels(count, np.array(pairs), ratios, weights)
    levels -= np.median(levels, axis=0)
    return np.exp(-levels) if np.ptp(levels, axis=0).max() > STEADY_LOG else np.ones((count, 3))


def compare(a: Content, b: Content) -> Link | None:
    """Compare two frames; None if no single gain explains what both show.

    The background decides if enough of it is visible: a turning head shades itself, a wall does not.
    """
    if min(len(a.place), len(b.place)) < LEAST_SPOTS:
        return None
    first, second = _matches(a.descriptors, b.descriptors)
    ratio, place = b.log_colour[second] - a.log_colour[first], a.place[first]
    person, behind = a.person[first] & b.person[second], ~(a.person[first] | b.person[second])
    common = _common(ratio[behind], place[behind])
    if common is not None:
        return Link(*common[:2])
    common = _common(ratio[person], place[person])
    if common is not None:
        return Link(*common[:2], True, common[2])
    slanted = _slanted(ratio[person].mean(1), place[person])
    return Link(np.zeros(3), float(person.sum()), True, True) if slanted else None


def _matches(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return indices into descriptors [n, 128] and [m, 128] of mutual nearest neighbours that are close."""
    unit = [
        d / np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1)
        for d in (a.astype(np.float32), b.astype(np.float32))
    ]
    likeness = unit[0] @ unit[1].T
    there, back = likeness.argmax(1), likeness.argmax(0)
    first = np.flatnonzero((back[there] == np.arange(len(a))) & (likeness.max(1) > 0.9))
    return first, there[first]


def _common(ratio: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, float, bool] | None:
    """Return the log gain [3] shared by most spots [n, 3], its weight, and whether it is shading; or None.

    Every square of the picture has one vote. Shading differs between the ends of the area [n, 2], exposure does not.
    """
    if len(ratio) < LEAST_SPOTS:
        return None
    cell = (place // 60).astype(int) @ [1, 64]
    weight = 1 / np.bincount(cell)[cell] ** 0.5
    centre = np.array([_weighted_median(channel, weight) for channel in ratio.T])
    agree = np.abs(ratio - centre).max(1) < TOLERANCE_LOG
    if agree.sum() < LEAST_SPOTS or weight[agree].sum() < LEAST_SHARE * weight.sum():
        return None
    ratio, place, weight = ratio[agree], place[agree], weight[agree]
    gain = np.average(ratio, axis=0, weights=weight)
    offset = (place - place.mean(0)) / np.maximum(place.std(0), 1)
    slope = np.linalg.lstsq(offset * weight[:, None], (ratio - gain).mean(1) * weight, rcond=None)[0]
    slant, noise = 3 * np.linalg.norm(slope), 9 * (ratio - gain).mean(1).std() / len(ratio) ** 0.5
    return gain, float(weight.sum()), bool(slant > max(noise, 0.5 * np.abs(gain).max()))


def _slanted(ratio: np.ndarray, place: np.ndarray) -> bool:
    """Return whether log ratios [n] without a common value lie on a slope across the picture [n, 2].

    Then they are shading, not wrong matches.
    """
    if len(ratio) < LEAST_SPOTS:
        return False
    ones = np.concatenate([(place - place.mean(0)) / np.maximum(place.std(0), 1), np.ones((len(place), 1))], 1)
    error = ratio - np.median(ratio)
    rest = error
    for _ in range(5):
        weight = 1 / np.sqrt(np.maximum(np.abs(rest), 0.02))
        rest = error - ones @ np.linalg.lstsq(ones * weight[:, None], error * weight, rcond=None)[0]
    return bool(np.median(np.abs(rest)) < 0.6 * np.median(np.abs(error)))


def _weighted_median(samples: np.ndarray, weights: np.ndarray) -> float:
    order = np.argsort(samples)
    total = np.cumsum(weights[order])
    return float(samples[order][np.searchsorted(total, total[-1] / 2)])


def _levels(count: int, pairs: np.ndarray, ratios: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Solve for the log light of every frame [N, 3] from the links by least squares, robustly."""
    from scipy.sparse import coo_matrix, diags
    from scipy.sparse.linalg import spsolve

    links = len(pairs)
    draw = coo_matrix(
        (np.repeat([-1.0, 1.0], links), (np.tile(np.arange(links), 2), pairs.T.ravel())), shape=(links, count)
    ).tocsr()
    chain = diags([-np.ones(count - 1), np.ones(count - 1)], [0, 1], shape=(count - 1, count))
    # frames without links follow their neighbours
    hold = 1e-3 * (chain.T @ chain) + 1e-9 * diags([np.ones(count)], [0])
    trust = np.ones(links)
    for _ in range(8):
        normal = draw.T @ diags([weights * trust], [0]) @ draw + hold
        levels = spsolve(normal.tocsc(), draw.T @ ((weights * trust)[:, None] * ratios))
        error = np.abs(draw @ levels - ratios).max(1)
        trust = np.minimum(1, 0.01 / np.maximum(error, 1e-9))
    return levels
