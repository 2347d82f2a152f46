# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How sharp a frame is, from where it sees the head, and which frames make the texture: the sharpest, evenly spread
around the head."""

from __future__ import annotations

import cv2
import numpy as np

from ...capture.frame_records import FrameRecord

REACH_SHARE = 0.1
"""A frame without a face may be chosen if one with a face is nearer than this share of the sequence: a profile, where
detectors fail."""


def inside_box(srgb: np.ndarray, box: tuple | None) -> np.ndarray:
    """The part of a picture in a box; its middle where there is none."""
    height, width = srgb.shape[:2]
    x0, y0, x1, y1 = box or (width / 4, height / 4, 3 * width / 4, 3 * height / 4)
    return srgb[max(0, int(y0)) : max(1, int(y1)), max(0, int(x0)) : max(1, int(x1))]


def sharpness(srgb: np.ndarray, box: tuple | None) -> float:
    """Tenengrad of what lies in a box (of the middle of the picture where there is none), relative to its brightness;
    higher is sharper.

    Mean squared Sobel gradient of luma over squared mean luma: exposure cancels, motion blur and defocus do not.
    """
    crop = inside_box(srgb, box)
    if crop.shape[0] < 8 or crop.shape[1] < 8:
        crop = srgb
    # below the noise, above the pores
    luma = cv2.GaussianBlur(crop @ np.array([0.299, 0.587, 0.114], np.float32), (0, 0), 0.8)
    gradient = cv2.Sobel(luma, cv2.CV_32F, 1, 0) ** 2 + cv2.Sobel(luma, cv2.CV_32F, 0, 1) ** 2
    return float(np.sqrt(gradient.mean()) / max(luma.mean(), 0.02))


def turns(records: list[FrameRecord]) -> np.ndarray:
    """From where each frame sees the head [N]: its yaw in degrees, carried on along the sequence where no face is
    found; nan too far from any face. One at least shows a face."""
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
    """Indices of at most `count` frames: from each of `count` equal steps of the turn [N] (nan: out) the sharpest [N];
    where a step is empty, the frame farthest from all chosen ones, among the sharper half."""
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
        turned = np.abs(turn[rest][:, None] - turn[chosen][None]).min(1)
        gap = turned + 0.01 * np.abs(rest[:, None] - np.array(chosen)[None]).min(1)
        chosen.append(int(rest[np.argmax(gap)]))
    return sorted(chosen)
