# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the white point: the linear colour of a white surface in the face's light, in the frames.

A ColorChecker is found by itself (opencv-contrib's mcc), a grey card or white paper is pointed at. `run` is the tool
behind the button Find ColorChecker. All frames of a capture have one exposure (frames/drift.py), so any frame serves.
"""

from __future__ import annotations

import cv2
import numpy as np

from ...capture.capture import Capture
from ...capture.messages import Problem, Reporter
from ...imaging import images
from ...settings.settings import CARDS, Settings

# of a ColorChecker's neutral patches, white to neutral 3.5 (L* 96.5, 81.3, 66.8, 50.9, 35.7), mean of measured charts
GREY_REFLECTANCES = np.array([0.914, 0.589, 0.363, 0.191, 0.088])
MAX_CHART_COST = 0.04  # above it mcc's chart is a guess
MAX_UNEVENNESS_LOG = 0.25  # deviation in log units of the greys about one white above which they are no chart's
USABLE_SRGB = 0.03, 0.96  # sRGB between which a patch has kept its value
MAX_FRAMES, ENOUGH_CHARTS = 60, 5  # frames searched, and charts after which the search ends
PATCH_SHARE = 0.006  # half the side, over the frame's longer side, of what is averaged where a card is pointed at
MAX_STRAY_LOG = 0.15  # deviation in log units within a card


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Leave the figures white_point (linear R, G, B) and white_point_frame. Raises Problem without a ColorChecker."""
    frames = sorted(capture.frames.glob("*.jpg"))
    frames = frames[:: max(1, len(frames) // MAX_FRAMES)]
    whites = {}
    for i, path in enumerate(frames):
        report.progress(i, len(frames), f"looking for a ColorChecker in frame {i + 1} of {len(frames)}")
        white = measure_chart_white(images.read_srgb(path))
        if white is not None:
            whites[path.name] = white
        if len(whites) == ENOUGH_CHARTS:
            break
    if not whites:
        raise Problem(
            "No ColorChecker was found in the frames.",
            "Film it flat, in focus, at least a fifth of the picture wide, or point at a grey card or white "
            "paper instead.",
        )
    report.figure("white_point", [round(float(v), 4) for v in np.median(list(whites.values()), 0)])
    report.figure("white_point_frame", next(iter(whites)))


def measure_chart_white(srgb: np.ndarray) -> np.ndarray | None:
    """Return the linear white [3] of a ColorChecker Classic in an sRGB frame [H, W, 3]; None if there is none."""
    detector = cv2.mcc.CCheckerDetector_create()
    pixels = np.ascontiguousarray(np.round(255 * np.clip(srgb[..., ::-1], 0, 1)).astype(np.uint8))
    if not detector.process(pixels, cv2.mcc.MCC24, 1):
        return None
    chart = detector.getBestColorChecker()
    if chart.getCost() > MAX_CHART_COST:
        return None
    patches = chart.getChartsRGB()[:, 1].reshape(24, 3)[18:23] / 255  # means; the last row without its black
    usable = ((patches > USABLE_SRGB[0]) & (patches < USABLE_SRGB[1])).all(1)
    if usable.sum() < 2:
        return None
    each = np.log(images.srgb_to_linear(patches[usable]) / GREY_REFLECTANCES[usable, None])
    return np.exp(each.mean(0)) if each.std(0).max() < MAX_UNEVENNESS_LOG else None


def measure_card_white(srgb: np.ndarray, column: float, row: float, card: str) -> np.ndarray:
    """Return the linear white [3] of a card, one of settings.CARDS, at a pixel of an sRGB frame [H, W, 3].

    Column and row count from the upper left. Raises Problem if the place is outside, burnt out or black, or uneven.
    """
    height, width = srgb.shape[:2]
    if not (0 <= column < width and 0 <= row < height):
        raise Problem(
            f"The place {column:g}, {row:g} is outside of the frame, which is {width} x {height}.",
            "Give the pixel's column and row from the upper left.",
        )
    reach = max(2, round(PATCH_SHARE * max(width, height)))
    top, left = max(0, int(row) - reach), max(0, int(column) - reach)
    patch = srgb[top : int(row) + reach + 1, left : int(column) + reach + 1].reshape(-1, 3)
    if np.median(patch, 0).max() >= 0.98 or np.median(patch, 0).min() < 0.03:
        raise Problem(
            "The card is overexposed or black there.",
            "Choose another frame or place, or a grey card instead of white paper.",
        )
    linear = images.srgb_to_linear(patch)
    if np.log(np.maximum(linear, 1e-3)).std(0).max() > MAX_STRAY_LOG:
        raise Problem(
            "That place is not of one colour.",
            "Point at the middle of the card, away from its border and from writing.",
        )
    return linear.mean(0) / CARDS[card]
