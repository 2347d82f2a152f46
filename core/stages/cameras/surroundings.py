# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Test whether everything but the head stays in place while the head turns.

A few pictures show it, before minutes are spent on features that would.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from ...capture.frame_records import FrameRecord
from ...face import faces
from ...imaging import images
from .coverage import spread_evenly
from .motion import LEAST_MATCHES, STILL_DIAGONAL_SHARE, TURNED_DEG

LONG_SIDE_PX = 480
"""Long side, in pixels, at which the pictures are compared."""
MOST_CORNERS, LEAST_QUALITY_SHARE = 400, 0.02
"""The most corners of a picture, and the least of one as a share of the best: that is one of the face's, beside which
the noise of a bare wall is none."""
MOST_FRAMES = 72
"""Frames of a film of a turning head that its cameras are solved from, spread over it: only the head tells of its
motion, and every frame has the whole of it."""


def surroundings_stay(face_by_name: dict[str, faces.Face], folder: Path) -> bool:
    """Return whether wall, shoulders and clothes stay in place between pictures in which the head has turned.

    False if there is too little to decide by, such as a bare wall.
    """
    names, votes = sorted(face_by_name), []
    small = {name: _read(folder / name) for name in names}
    for i, first in enumerate(names):
        face = face_by_name[first]
        second = next(
            (name for name in names[i + 1 :] if abs(face_by_name[name].yaw_deg - face.yaw_deg) >= TURNED_DEG), None
        )
        share = None if second is None else _share_that_stays(small[first], small[second], face, face_by_name[second])
        votes += [] if share is None else [share > 0.6]
    return len(votes) >= 2 and bool(np.mean(votes) > 0.6)


def spread_over(records: Sequence[FrameRecord]) -> tuple[FrameRecord, ...]:
    """Return MOST_FRAMES of a film's frames, evenly spread, and those that the texture is made from."""
    even = set(spread_evenly(range(len(records)), MOST_FRAMES))
    return tuple(record for i, record in enumerate(records) if i in even or record.selected)


def _read(path: Path) -> tuple[np.ndarray, float]:
    """Return a small picture in grey levels and its scale."""
    picture = images.read_srgb(path)
    scale = min(1.0, LONG_SIDE_PX / max(picture.shape[:2]))
    picture = images.resize(picture, round(scale * picture.shape[1]), round(scale * picture.shape[0]))
    return np.round(255 * np.clip(picture.mean(-1), 0, 1)).astype(np.uint8), scale


def _share_that_stays(picture: tuple, turned_picture: tuple, face: faces.Face, turned: faces.Face) -> float | None:
    """Return the share of corners off both heads that are at the same place in both pictures.

    None if there are too few.
    """
    (first, scale), (second, _) = picture, turned_picture
    corners = cv2.goodFeaturesToTrack(first, MOST_CORNERS, LEAST_QUALITY_SHARE, 4)
    if corners is None or first.shape != second.shape:
        return None
    at = corners.reshape(-1, 2)
    off = ~_on_head(at / scale, face) & ~_on_head(at / scale, turned)
    if off.sum() < LEAST_MATCHES:
        return None
    there, forward_status, _ = cv2.calcOpticalFlowPyrLK(first, second, corners[off], None)
    back, back_status, _ = cv2.calcOpticalFlowPyrLK(second, first, there, None)
    motion = np.linalg.norm((there - corners[off]).reshape(-1, 2), axis=1)
    still = motion < STILL_DIAGONAL_SHARE * np.hypot(*first.shape)
    return_error = np.linalg.norm((back - corners[off]).reshape(-1, 2), axis=1)
    sure = (forward_status.ravel() > 0) & (back_status.ravel() > 0) & (return_error < 1)
    return float((still & sure).mean())


def _on_head(pixels: np.ndarray, face: faces.Face) -> np.ndarray:
    """Return a mask [N] of pixels [N, 2] that lie on the head, its hair or its neck, roughly."""
    x0, y0, x1, y1 = face.box
    beside = np.abs(pixels[:, 0] - (x0 + x1) / 2) < 1.1 * (x1 - x0)
    return beside & (pixels[:, 1] > y0 - 0.7 * (y1 - y0)) & (pixels[:, 1] < y1 + 0.4 * (y1 - y0))
