# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Exposure and white balance that a camera changed: one gain per frame and channel, from witnesses of stated deviation.

The same surface points are found in two frames (SIFT; Lowe 2004) and kept if they moved as their neighbours did. Those
of the ground, whose light stays, tell a change to a few percent. On an empty ground there are none, and the person
alone does not tell: a face that turns gets other light. Then what counts is the change that person and ground have in
common, and without a ground a jump beyond what the person's points disagree by. A third witness is the metadata of
photographs: time, aperture and sensitivity.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import cv2
import numpy as np

from ...face import faces
from ...imaging import images

WIDTH_PX = 480
"""Longer side of the pictures compared: fine detail and noise are gone, motion blur hardly matters."""
SPOT_PX = 9
"""Side of the square over which a spot's colour is averaged."""
CELL_PX = 40
"""Side of the squares within which spots count as one: neighbours err alike."""
STEPS_FRAMES = (1, 2, 5, 12)
"""Distances of compared frames: near ones are accurate, far ones keep small errors from adding up."""
ALL_PAIRS_FRAMES = 20
"""Up to so many frames all are compared with each other: the names of photographs do not tell neighbours."""
LEAST_SPOTS, LEAST_SHARE = 16, 0.4
"""Minimum number and share of matched spots that move as their neighbours do."""
NEIGHBOURS, SLACK_PX, SLACK_SHARE = 6, 3.0, 0.25
"""A spot moves with its nearest ones if it deviates by less from their median motion, in pixels or as a share of it."""
CLIPPED_SRGB, BLACK_LINEAR = 0.97, 0.004
"""Brighter and darker colours are not compared."""
GROUND_PX, LEAST_CELLS = 24, 12
"""Side of the squares over which the ground is averaged, and the minimum number of them in both of two frames."""
SURE = 2.0
"""Deviations beyond which a change is one."""
OF_MEDIAN = 1.2533
"""Standard error of the median of n normal values, times the root of n, in their deviations."""
ERROR_LOG, METADATA_LOG = 0.005, 0.1
"""Deviations, in natural log units, of one comparison (compression, lens) and of an exposure by the metadata (rounded,
and followed by a tone curve)."""
STEADY_LOG = 0.08
"""Range of the gains, in natural log units, up to which no picture is changed: the texture evens out what is less."""


@dataclass(frozen=True)
class Content:
    """Spots of a frame: descriptors uint8 [n, 128], log_colour float32 [n, 3] (linear light), place float32 [n, 2].

    place is in pixels of the small picture; person bool [n]: on the person, else on the ground. ground float32
    [h, w, 3]: log colour of squares behind the person, nan where there are none. exposure: its log by the metadata, if
    they state it.
    """

    descriptors: np.ndarray
    log_colour: np.ndarray
    place: np.ndarray
    person: np.ndarray
    ground: np.ndarray
    exposure: float | None = None


def content_of(srgb: np.ndarray, exposure: float | None = None) -> Content:
    """Return the spots of a frame, sRGB [H, W, 3], that are neither clipped nor black, and its ground."""
    scale = WIDTH_PX / max(srgb.shape[:2])
    small = images.resize(srgb, round(srgb.shape[1] * scale), round(srgb.shape[0] * scale))
    whole = np.ones((SPOT_PX, SPOT_PX), np.uint8)
    mean = cv2.blur(images.srgb_to_linear(small), (SPOT_PX, SPOT_PX))
    log_colour = np.log(np.maximum(mean, 1e-5))
    # a reduction over three neighbours in memory takes ten times as long
    brightest, darkest = reduce(np.maximum, cv2.split(small)), reduce(np.minimum, cv2.split(mean))
    fair = (cv2.dilate(brightest, whole) < CLIPPED_SRGB) & (darkest > BLACK_LINEAR)
    person = faces.segment_person(small)
    inside, outside = person > 0.5, cv2.dilate(person, whole) < 0.1
    square, middles = (GROUND_PX, GROUND_PX), slice(GROUND_PX // 2, None, GROUND_PX)
    clear = cv2.erode((fair & outside).astype(np.uint8), np.ones(square, np.uint8)) > 0
    ground = np.where(clear[..., None], cv2.blur(log_colour, square), np.nan)[middles, middles]
    grey = np.clip(images.luma(small) * 255, 0, 255).astype(np.uint8)
    points, descriptors = cv2.SIFT_create(600, contrastThreshold=0.015).detectAndCompute(grey, None)
    place = np.array([point.pt for point in points], np.float32).reshape(-1, 2)
    x, y = np.clip(place.round().astype(int), 0, np.array(grey.shape[::-1]) - 1).T
    kept = (fair & (inside | outside))[y, x]
    descriptors = np.zeros((0, 128), np.uint8) if descriptors is None else descriptors.astype(np.uint8)
    return Content(descriptors[kept], log_colour[y, x][kept], place[kept], inside[y, x][kept], ground, exposure)


@dataclass(frozen=True)
class Link:
    """Comparison of two frames: gain [3], the log of the second's light over the first's, and its deviation.

    bias: by how much shading, which errs to one side in all frames of a turn, may have changed the gain.
    """

    gain: np.ndarray
    deviation: float
    bias: float = 0.0


def gains_of(contents: list[Content], check=lambda: None) -> np.ndarray:
    """Return factors [N, 3] in linear light that even the frames out, 1 for the median frame.

    Exactly 1 throughout if the change is no larger than what shading may account for, or unsure comparisons. `check` is
    called between comparisons.
    """
    count = len(contents)
    steps = range(1, count) if count <= ALL_PAIRS_FRAMES else STEPS_FRAMES
    pairs, links = [], []
    for first, second in ((i, i + step) for step in steps for i in range(count - step)):
        check()
        link = compare(contents[first], contents[second])
        if link is not None:
            pairs.append((first, second))
            links.append(link)
    stated = [content.exposure for content in contents]
    if contents and None not in stated:  # relative to a frame that has no picture
        pairs += [(count, i) for i in range(count)]
        links += [Link(np.full(3, exposure - stated[0]), METADATA_LOG) for exposure in stated]
    if not links:
        return np.ones((count, 3))
    levels, biases, covariance = _levels(count + 1, np.array(pairs), links)
    levels = levels[:count] - np.median(levels[:count], axis=0)
    low, high = levels.mean(1).argmin(), levels.mean(1).argmax()
    unsure = SURE * np.sqrt(covariance[low, low] + covariance[high, high] - 2 * covariance[low, high])
    changed = np.ptp(levels, axis=0).max() > max(STEADY_LOG, biases[high] - biases[low], unsure)
    return np.exp(-levels) if changed else np.ones((count, 3))


def compare(a: Content, b: Content) -> Link | None:
    """Compare two frames; None if too few surface points are in both."""
    first, second = _matches(a.descriptors, b.descriptors)
    ratio = b.log_colour[second] - a.log_colour[first]
    for person in (False, True):
        here = np.flatnonzero((a.person[first] == person) & (b.person[second] == person))
        here = here[_moving_together(a.place[first[here]], b.place[second[here]])]
        if not len(here):
            continue
        link = _common(ratio[here])
        if person:
            return _agreed(link, _ground_gain(a, b))
        cells = len(np.unique(a.place[first[here]] // CELL_PX, axis=0))
        return Link(link.gain, max(OF_MEDIAN * link.deviation / cells**0.5, ERROR_LOG))
    return None


def _ground_gain(a: Content, b: Content) -> Link | None:
    """Compare the ground where it is seen in both frames; None if that is hardly anywhere."""
    if a.ground.shape != b.ground.shape:
        return None
    ratio = (b.ground - a.ground)[np.isfinite(b.ground - a.ground).all(-1)]
    return _common(ratio) if len(ratio) >= LEAST_CELLS else None


def _agreed(person: Link, ground: Link | None) -> Link:
    """Return what is exposure of the person's change: the smaller one of both, none if they contradict each other.

    It may be shading by as much as the better witness is unsure, and is as uncertain as they are apart.
    """
    witnesses = [person, ground] if ground else [person]
    gain = min((link.gain for link in witnesses), key=lambda gain: abs(gain.mean()))
    shading = abs(gain.mean()) < SURE * person.deviation if ground is None else (person.gain * ground.gain).mean() < 0
    if shading:
        gain = np.zeros(3)
    bias = min(link.deviation for link in witnesses)
    apart = max(abs((gain - link.gain).mean()) for link in witnesses)
    return Link(gain, float(np.hypot(bias, apart)), bias)


def _matches(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return indices into descriptors [n, 128] and [m, 128] of mutual nearest neighbours that are close."""
    if min(len(a), len(b)) < LEAST_SPOTS:
        return np.zeros(0, int), np.zeros(0, int)
    unit = [
        d / np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1)
        for d in (a.astype(np.float32), b.astype(np.float32))
    ]
    likeness = unit[0] @ unit[1].T
    there, back = likeness.argmax(1), likeness.argmax(0)
    first = np.flatnonzero((back[there] == np.arange(len(a))) & (likeness.max(1) > 0.9))
    return first, there[first]


def _moving_together(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return which matches between places [n, 2] move as their neighbours do; none if these are few."""
    if len(a) < LEAST_SPOTS:
        return np.zeros(len(a), bool)
    from scipy.spatial import cKDTree

    motion = b - a
    near = cKDTree(a).query(a, 1 + NEIGHBOURS)[1][:, 1:]
    usual = np.median(motion[near], axis=1)
    slack = np.maximum(SLACK_PX, SLACK_SHARE * np.linalg.norm(usual, axis=1))
    agree = np.linalg.norm(motion - usual, axis=1) < slack
    return agree if agree.sum() >= max(LEAST_SPOTS, LEAST_SHARE * len(a)) else np.zeros(len(a), bool)


def _common(ratio: np.ndarray) -> Link:
    """Return the median of log ratios [n, 3], and the least sure channel's median absolute deviation from it."""
    gain = np.median(ratio, axis=0)
    deviation = 1.4826 * np.median(np.abs(ratio - gain), axis=0)
    return Link(gain, max(float(deviation.max()), ERROR_LOG))


def _levels(count: int, pairs: np.ndarray, links: list[Link]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Solve for the log light of every frame [N, 3] from the links by least squares, robustly (Cauchy's weights).

    Returns also what the links' biases add up to [N], if all are to the side of the change, and the covariance [N, N].
    """
    rows = np.arange(len(pairs))
    draw = np.zeros((len(pairs), count))
    draw[rows, pairs[:, 0]], draw[rows, pairs[:, 1]] = -1, 1
    ratios, deviations = np.array([link.gain for link in links]), np.array([link.deviation for link in links])
    # frames without links follow their neighbours
    chain = np.diff(np.eye(count), axis=0)
    hold = 1e-3 * chain.T @ chain + 1e-9 * np.eye(count)
    trust = np.ones(len(pairs))
    for _ in range(8):
        weighted = draw * (trust / deviations**2)[:, None]
        covariance = np.linalg.inv(draw.T @ weighted + hold)
        solve = covariance @ weighted.T
        levels = solve @ ratios
        trust = 1 / (1 + (np.abs(draw @ levels - ratios).max(1) / (SURE * deviations)) ** 2)
    return levels, solve @ (np.array([link.bias for link in links]) * np.sign(draw @ levels.mean(1))), covariance
