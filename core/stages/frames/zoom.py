# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Zoom in the middle of a film, or a switch of lenses, found from its pictures: each part needs a camera of its own.

Between neighbouring frames a camera that walks around a head changes the size of what it sees by a few percent; a phone
that switches lenses changes it at once by a half or more. (A slow zoom looks like a step towards the face, and is told
by the cameras.)
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from ...imaging import images

LONG_SIDE_PX, MOST_FEATURES = 480, 500
"""Size at which frames are compared, and features of each."""
REACH_PX, LEAST_MATCHES = 4.0, 20
"""How far a match may miss the similarity between two frames, and how many must not."""
JUMP = 1.25
"""Magnification from one frame to the next that only a zoom makes. Between neighbours in films of 6 to 100 frames
around a head it is at most 1.15; what lies between is left to the cameras, as a slow zoom is."""
SAME = 1.04
"""Parts whose magnifications differ by less are of one lens, as after a switch there and back."""

Features = tuple[np.ndarray, np.ndarray | None]
"""Places [N, 2] in pixels at that size, and descriptors [N, 32], of a frame."""


def features_of(srgb: np.ndarray) -> Features:
    """Detect ORB features (Rublee et al., 2011) in a frame [H, W, 3]."""
    height, width = srgb.shape[:2]
    scale = LONG_SIDE_PX / max(height, width)
    small = images.resize(srgb[..., 1], round(width * scale), round(height * scale))
    keypoints, descriptors = cv2.ORB_create(MOST_FEATURES).detectAndCompute(
        np.round(255 * np.clip(small, 0, 1)).astype(np.uint8), None
    )
    return np.float32([keypoint.pt for keypoint in keypoints]).reshape(-1, 2), descriptors


def zooms_of(features: Sequence[Features]) -> list[float]:
    """Return each frame's magnification relative to the first frame's, constant within a part of one lens."""
    zooms = [1.0][: len(features)]
    for first, second in zip(features, features[1:], strict=False):
        scale = _scale_between(first, second)
        zoom = zooms[-1]
        if scale is not None and max(scale, 1 / scale) > JUMP:
            zoom = next((old for old in zooms if 1 / SAME < zoom * scale / old < SAME), round(zoom * scale, 3))
        zooms.append(zoom)
    return zooms


def _scale_between(first: Features, second: Features) -> float | None:
    """Return by how much larger the second frame shows what both show, or None if too little matches."""
    if first[1] is None or second[1] is None:
        return None
    matches = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(first[1], second[1])
    if len(matches) < LEAST_MATCHES:
        return None
    pairs = np.array([(match.queryIdx, match.trainIdx) for match in matches])
    cv2.setRNGSeed(0)
    similarity, inliers = cv2.estimateAffinePartial2D(
        first[0][pairs[:, 0]], second[0][pairs[:, 1]], method=cv2.RANSAC, ransacReprojThreshold=REACH_PX
    )
    if similarity is None or inliers.sum() < LEAST_MATCHES:
        return None
    return float(np.hypot(*similarity[:, 0]))
