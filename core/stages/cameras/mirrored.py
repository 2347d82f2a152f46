# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection of mirrored pictures: those whose mirror image matches the others better than they do.

A set that is mirrored as a whole cannot be recognised by its geometry. Lowe, Distinctive Image Features (2004);
Arandjelovic and Zisserman's RootSIFT (2012).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import cv2
import numpy as np

from ...capture.messages import Reporter
from ...face import faces
from ...imaging import images

LONG_SIDE_PX = 640
MOST_FEATURES = 1500
"""Size of the compared pictures, and features of each: enough to decide whether two match as they are or mirrored."""
LEAST_MATCHES = 20
"""Matches on one epipolar geometry that two views of one scene have at least."""
MOST_PAIRS = 60
"""Compared pairs, spread over all."""


def find_mirrored(
    suspects: list[str],
    trusted: list[str],
    folder: Path,
    report: Reporter,
    face_by_name: Mapping[str, faces.Face] = MappingProxyType({}),
) -> list[str]:
    """Return the names of suspects in a folder that are mirrored with respect to others.

    trusted: names of pictures that are not mirrored; without any, most of the suspects are trusted. Two pictures of a
    face from opposite sides match when one is flipped, mirrored or not, because faces are symmetric: for those only
    what lies beside the face counts.
    """
    among_suspects = [(a, b) for i, a in enumerate(suspects) for b in suspects[i + 1 :]]
    pairs = [(a, b) for a in suspects for b in trusted] or among_suspects
    if len(pairs) > MOST_PAIRS:
        pairs = [pairs[i] for i in np.linspace(0, len(pairs) - 1, MOST_PAIRS).round().astype(int)]
    features_by_name: dict[tuple, tuple] = {}
    sizes: dict[str, tuple[int, int]] = {}

    def features(name: str, flip: bool) -> tuple:
        if (name, flip) not in features_by_name:
            picture = images.read_srgb(folder / name)
            sizes[name] = picture.shape[1], picture.shape[0]
            features_by_name[name, flip] = _describe(picture, flip)
        return features_by_name[name, flip]

    relation: dict[tuple[str, str], int] = {}
    for index, (a, b) in enumerate(pairs):
        report.progress(index, len(pairs), "looking for mirrored pictures")
        yaws = [face_by_name[name].yaw_deg for name in (a, b) if name in face_by_name]
        opposite = len(yaws) == 2 and abs(yaws[0] + yaws[1]) < abs(yaws[0] - yaws[1])
        plain, flipped = (
            _agreeing(
                *(
                    _beside(features(name, mirror), face_by_name[name], mirror, sizes[name])
                    if opposite
                    else features(name, mirror)
                    for name, mirror in ((a, flip), (b, False))
                )
            )
            for flip in (False, True)
        )
        if max(plain, flipped) >= LEAST_MATCHES and max(plain, flipped) > 2 * min(plain, flipped):
            relation[a, b] = 1 if plain > flipped else -1
    return _minority(relation, suspects, trusted)


def _minority(relation: dict[tuple[str, str], int], suspects: list[str], trusted: list[str]) -> list[str]:
    """Return suspects that are mirrored with respect to the trusted pictures, or to the majority."""
    side = dict.fromkeys(trusted, 1)
    if not side and relation:
        side[max(suspects, key=lambda name: sum(name in pair for pair in relation))] = 1
    while True:
        sides = {
            a if b in side else b: sign * side[b if b in side else a]
            for (a, b), sign in relation.items()
            if (a in side) != (b in side)
        }
        if not sides:
            break
        side |= sides
    less = -1 if trusted or sum(s < 0 for s in side.values()) <= len(side) / 2 else 1
    return sorted(name for name in suspects if side.get(name) == less)


def _beside(features: tuple, face: faces.Face, flip: bool, size: tuple[int, int]) -> tuple:
    """Return a picture's features off the head; size: width and height of the picture with the detected face."""
    points, descriptors = features
    x0, y0, x1, y1 = face.box
    w, h = x1 - x0, y1 - y0
    x0, x1 = (size[0] - x1, size[0] - x0) if flip else (x0, x1)
    at = points / min(1.0, LONG_SIDE_PX / max(size))
    off = (
        (at[:, 0] < x0 - 0.6 * w) | (at[:, 0] > x1 + 0.6 * w) | (at[:, 1] < y0 - 0.7 * h)
        if len(points)
        else np.zeros(0, bool)
    )
    return points[off], descriptors[off]


def _describe(srgb: np.ndarray, flip: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return keypoints [K, 2] and RootSIFT descriptors [K, 128] of a picture, mirrored first if `flip`."""
    scale = min(1.0, LONG_SIDE_PX / max(srgb.shape[:2]))
    grey = images.resize(
        srgb @ np.array([0.299, 0.587, 0.114], np.float32), round(srgb.shape[1] * scale), round(srgb.shape[0] * scale)
    )
    grey = np.ascontiguousarray((np.clip(grey[:, ::-1] if flip else grey, 0, 1) * 255).astype(np.uint8))
    points, descriptors = cv2.SIFT_create(MOST_FEATURES, contrastThreshold=0.02).detectAndCompute(grey, None)
    if descriptors is None:
        return np.zeros((0, 2), np.float32), np.zeros((0, 128), np.float32)
    root_sift = np.sqrt(descriptors / np.maximum(descriptors.sum(1, keepdims=True), 1e-9))
    return np.array([point.pt for point in points], np.float32), root_sift


def _agreeing(a: tuple, b: tuple) -> int:
    """Count the matches between two pictures that lie on one epipolar geometry."""
    if min(len(a[0]), len(b[0])) < LEAST_MATCHES:
        return 0
    matches = [
        pair[0]
        for pair in cv2.BFMatcher(cv2.NORM_L2).knnMatch(a[1], b[1], k=2)
        if len(pair) == 2 and pair[0].distance < 0.8 * pair[1].distance
    ]
    if len(matches) < LEAST_MATCHES:
        return 0
    cv2.setRNGSeed(0)
    _, good = cv2.findFundamentalMat(
        a[0][[m.queryIdx for m in matches]], b[0][[m.trainIdx for m in matches]], cv2.FM_RANSAC, 1.5, 0.999
    )
    return 0 if good is None else int(good.sum())
