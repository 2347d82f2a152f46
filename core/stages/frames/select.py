# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sharpness of frames, their view of the head, and the choice of views: the sharpest, evenly spread around the head."""

from __future__ import annotations

import cv2
import numpy as np

from ...capture.frame_records import FrameRecord
from ...imaging import images

REACH_SHARE = 0.1
"""A frame without a face may be chosen if one with a face is nearer than this share of the sequence: detectors fail on
profiles."""


def inside_box(srgb: np.ndarray, box: tuple | None) -> np.ndarray:
    """Return the part of a picture in a box, or its middle."""
    height, width = srgb.shape[:2]
    x0, y0, x1, y1 = box or (width / 4, height / 4, 3 * width / 4, 3 * height / 4)
    return srgb[max(0, int(y0)) : max(1, int(y1)), max(0, int(x0)) : max(1, int(x1))]


def sharpness(srgb: np.ndarray, box: tuple | None) -> float:
    """Return the Tenengrad inside a box (or the middle of the picture) relative to its brightness.

    Mean squared Sobel gradient of luma over squared mean luma: exposure cancels, motion blur and defocus do not.
    """
    crop = inside_box(srgb, box)
    if crop.shape[0] < 8 or crop.shape[1] < 8:
        crop = srgb
    # below the noise, above the pores
    luma = cv2.GaussianBlur(images.luma(crop), (0, 0), 0.8)
    gradient = cv2.Sobel(luma, cv2.CV_32F, 1, 0) ** 2 + cv2.Sobel(luma, cv2.CV_32F, 0, 1) ** 2
    return float(np.sqrt(gradient.mean()) / max(luma.mean(), 0.02))


def turns(records: list[FrameRecord]) -> np.ndarray:
    """Return the head's yaw in each frame [N] in degrees, extrapolated where no face is found.

    nan too far from any face. At least one frame shows a face.
    """
    order = np.arange(len(records))
    known = np.array([r.yaw_deg is not None for r in records])
    yaw = np.array([r.yaw_deg or 0.0 for r in records])
    turn = np.interp(order, order[known], yaw[known])
    for end, inner in ((order[known][0], slice(None, 5)), (order[known][-1], slice(-5, None))):
        beyond = order < end if end == order[known][0] else order > end
        if known.sum() >= 5 and beyond.any():
            speed = np.polyfit(order[known][inner], yaw[known][inner], 1)[0]
            turn[beyond] = yaw[end] + np.clip(speed * (order[beyond] - end), -40, 40)
    far = np.abs(order[:, None] - order[known][None]).min(1) > REACH_SHARE * len(records)
    return np.where(far & (len(records) > 12), np.nan, turn)


def select_views(sharp: np.ndarray, turn: np.ndarray, count: int) -> list[int]:
    """Return indices of at most `count` frames: the sharpest [N] of each of `count` equal steps of the turn [N].

    For an empty step, the frame farthest from all chosen ones among the sharper half. A turn of nan is not chosen.
    """
    candidates = np.flatnonzero(np.isfinite(turn))
    if len(candidates) <= count:
        return sorted(candidates.tolist())
    edges = np.linspace(turn[candidates].min(), turn[candidates].max() + 1e-6, count + 1)
    chosen = []
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        inside = candidates[(turn[candidates] >= low) & (turn[candidates] < high)]
        if len(inside):
            chosen.append(int(inside[np.argmax(sharp[inside])]))
    while len(chosen) < count:
        rest = np.setdiff1d(candidates, chosen)
        rest = rest[sharp[rest] >= np.median(sharp[rest])]
        gap = np.abs(turn[rest][:, None] - turn[chosen][None]).min(1)
        gap += 0.01 * np.abs(rest[:, None] - np.array(chosen)[None]).min(1)
        chosen.append(int(rest[np.argmax(gap)]))
    return sorted(chosen)
