# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The video doctor: what is wrong with a capture as its frames show it, and how to shoot it again.

`examine` measures a frame as it is written; `diagnose` turns the measures of all frames into findings.
"""

from __future__ import annotations

import cv2
import numpy as np
from skimage.measure import blur_effect

from ...capture.frame_records import FrameRecord
from ...capture.messages import Problem, Reporter, name_some
from ...imaging import images
from .select import inside_box, turns

UNMEASURED = {"blur": 1.0, "brightness": 0.0, "clipped": 0.0, "noise": 0.0}
"""Values for pictures too small to measure."""
FEW_FRAMES = 12
"""The report warns if there are fewer."""
BLURRED_CRETE = 0.68
"""Crete's measure of a face blurred by about 7 px; sharp faces have 0.35 to 0.6, at 9 px it is 0.7 to 0.8."""
DARK_SRGB, CLIPPED_SHARE, NOISY_SRGB = 0.22, 0.06, 6 / 255
"""sRGB of a face's bright quarter; share of clipped pixels; standard deviation of the noise in sRGB."""
SMALL_PX, FAR_SHARE = 160, 0.22
"""Width of a face in pixels, and as a share of the picture's shorter side."""
REACH_DEG, GAP_DEG = 32.0, 22.0
"""Required range of the head's turn to each side, and the widest gap between neighbouring directions."""
DRIFT_RATIO = 1.12
"""Ratio of the brightest frame's light to the darkest's from which the exposure counts as changed."""
EQUAL_RATIO, OFTEN_SHARE = 0.75, 0.5
"""Prominence of a second face over the first at which the subject is unclear, and the share of frames with that."""

DRAFTS = (
    (
        "There is only one photograph: a draft. The head's depth, sides and ears are guessed from other people's.",
        "Take a second one from about 40 degrees to one side, which measures the depth and shows that cheek and ear; a "
        "third from the other side makes it a whole face.",
    ),
    (
        "There are only two photographs: a draft. What neither shows is guessed from other people's heads.",
        "Take a third one, so that the front and both sides are there, about 40 degrees apart: then the head follows "
        "this person's on both sides.",
    ),
)
"""Problem and remedy of one photograph and of two."""
FEW_SIDES = (
    "Take one from the front, one about 40 degrees to each side, both profiles, and some from below and "
    "above, while the person sits still."
)
FIND_FACE = "Film one face, upright, filling a third of the picture or more, and lit well enough to see the eyes."


def examine(srgb: np.ndarray, box: tuple | None) -> dict:
    """Measure blur (Crete et al., "The Blur Effect", 2007: 0 sharp, 1 blurred), brightness, clipping and noise.

    Of the face's box, or the middle of the picture; brightness and noise in sRGB, clipped as a share.
    """
    inside = inside_box(srgb, box)
    if min(inside.shape[:2]) < 24:
        inside = srgb
    luma = images.luma(inside)
    # the corners of a face's box show the background
    rows, columns = (slice(n // 6, n - n // 6) for n in luma.shape)
    measures = {
        "blur": round(float(blur_effect(luma)), 4),
        "brightness": round(float(np.percentile(luma[rows, columns], 75)), 4),
        "clipped": round(float((inside[rows, columns].max(-1) > 0.99).mean()), 4),
        "noise": round(_noise(luma), 5),
    }
    return {name: value if np.isfinite(value) else UNMEASURED[name] for name, value in measures.items()}


def blurred(records: list[FrameRecord], around: int = 10) -> np.ndarray:
    """Return which frames [N] are much more blurred than those around them.

    At most a third, and never so many that few are left.
    """
    blur = np.array([r.blur for r in records])
    usual = np.array([np.median(blur[max(0, i - around) : i + around + 1]) for i in range(len(blur))])
    worse = np.where(blur > 0.55, blur - usual - 0.08, 0)
    most = max(0, min(len(blur) // 3, len(blur) - FEW_FRAMES))
    worst = np.zeros(len(blur), bool)
    worst[np.argsort(-worse, kind="stable")[:most]] = True
    return worst & (worse > 0)


def diagnose(records: list[FrameRecord], dropped: list[str], photographs: bool, report: Reporter) -> None:
    """Report a finding for each shortcoming of the kept frames; `dropped`: names of those left out as blurred.

    Raises Problem if no frame shows a face, or two faces compete.
    """
    with_face = [r for r in records if r.face_box]
    if not with_face:
        raise Problem("The only frames with a face are blurred and were left out.", FIND_FACE)
    count, shots = len(records), "photographs" if photographs else "frames"
    _other_faces(with_face, shots, report)
    if photographs and count <= len(DRAFTS):
        report.finding(*DRAFTS[count - 1])
    elif count < FEW_FRAMES:
        there = f"There are only {count} {shots}"
        expect = (
            "a head that follows features and outlines, with less detail than a film's"
            if photographs
            else "a rough head with holes at the sides"
        )
        report.finding(
            f"{there}: expect {expect}, and a texture from few directions.",
            "Take 60 or more around the face for a complete head.",
        )
    lost = [r.name for r in records if not r.face_box]
    if len(lost) > 0.4 * count:
        report.finding(
            f"No face was found in {len(lost)} of {count} {shots}.",
            "Keep the whole face in the picture, upright and well lit.",
            lost,
        )
    if count > 1:
        _angles(records, photographs, report)
    _size(with_face, report)
    _light(with_face, photographs, report)
    _sharpness(with_face, dropped, count, shots, report)


def _other_faces(records: list[FrameRecord], shots: str, report: Reporter) -> None:
    second = [r for r in records if r.other_face > 0]
    if sum(r.other_face > EQUAL_RATIO for r in records) > OFTEN_SHARE * len(records):
        raise Problem(
            "There are two faces in the picture, and it is not clear whose head to build.",
            f"Film one person alone, or crop the {'video' if shots == 'frames' else shots} so that one face "
            "fills the middle of the picture.",
        )
    if len(second) > max(1, 0.05 * len(records)):
        report.finding(
            f"A second face is in {len(second)} of {len(records)} {shots}; the larger one near the middle was "
            "followed.",
            "Film one person alone, and away from pictures of faces.",
            _names(second),
        )


def _angles(records: list[FrameRecord], photographs: bool, report: Reporter) -> None:
    # photographs are in alphabetical order, so neighbours say nothing about one without a face
    turn = np.array([r.yaw_deg for r in records if r.yaw_deg is not None]) if photographs else turns(records)
    turn = np.sort(turn[np.isfinite(turn)])
    again = (
        FEW_SIDES
        if photographs and len(records) < FEW_FRAMES
        else "Start at one ear and walk around the face to the other, at arm's length, while the person sits still."
    )
    left, right = -turn[0], turn[-1]
    if max(left, right) < REACH_DEG:
        report.finding(
            f"The face is seen from the front only: the camera moved {max(left, 0):.0f} degrees around to its left "
            f"and {max(right, 0):.0f} to its right.",
            again,
        )
    elif min(left, right) < REACH_DEG:
        side, reach = ("left", left) if left < right else ("right", right)
        report.finding(
            f"The {side} side of the face is hardly seen: the camera moved only {reach:.0f} degrees around to it."
            if reach > 0
            else f"The {side} side of the face is not seen at all.",
            again,
        )
    gaps = np.diff(turn) if not photographs or len(records) >= FEW_FRAMES else []
    if len(gaps) and turn[0] < 0 < turn[-1] and gaps.max() > GAP_DEG:
        at = int(gaps.argmax())
        report.finding(
            f"Between {turn[at]:.0f} and {turn[at + 1]:.0f} degrees of turn the face was not seen.",
            "Take photographs every 10 degrees or so."
            if photographs
            else "Walk slowly and evenly, and keep the face in the picture.",
        )


def _size(records: list[FrameRecord], report: Reporter) -> None:
    width = np.array([r.face_box[2] - r.face_box[0] for r in records])
    share = float(np.median(width / [min(r.size) for r in records]))
    if share < FAR_SHARE:
        report.finding(
            f"The face is small in the picture: {share:.0%} of its width.",
            "Go closer until the head fills half of the picture.",
            _names([r for r, w in zip(records, width, strict=True) if w < FAR_SHARE * min(r.size)]),
        )
    elif np.median(width) < SMALL_PX:
        report.finding(
            f"The face is only {np.median(width):.0f} pixels wide, too few for pores.",
            "Go closer, shoot in the highest resolution, or raise the setting Long Side of the frames where "
            "the pictures are larger.",
        )


def _light(records: list[FrameRecord], photographs: bool, report: Reporter) -> None:
    bright, clipped, noise = np.array([(r.brightness, r.clipped, r.noise) for r in records]).T
    if np.median(bright) < DARK_SRGB:
        report.finding(
            "The face is too dark: shadows hide its colour.",
            "Film in daylight or near a window, and tap on the face to set the exposure.",
            _names([r for r in records if r.brightness < DARK_SRGB]),
        )
    if np.median(clipped) > CLIPPED_SHARE:
        report.finding(
            f"The face is overexposed: {np.median(clipped):.0%} of it has no colour left.",
            "Tap on the brightest part of the face and lower the exposure before filming.",
            _names([r for r in records if r.clipped > CLIPPED_SHARE]),
        )
    if np.median(noise) > NOISY_SRGB:
        report.finding(
            "The picture is noisy, and the noise would pass for pores.",
            "Film in more light and without digital zoom.",
        )
    gain = np.array([r.gain for r in records])
    tone = gain / gain.mean(1, keepdims=True)
    ratio, tint = float(np.median(gain, 1).max() / np.median(gain, 1).min()), float((tone.max(0) / tone.min(0)).max())
    if ratio > DRIFT_RATIO or tint > DRIFT_RATIO:
        what = f"The exposure changed by {ratio - 1:.0%}" if ratio > DRIFT_RATIO else "The white balance changed"
        report.finding(
            f"{what} {'between the photographs' if photographs else 'while filming'}; it was evened out as far as "
            "possible.",
            "Lock exposure and white balance: hold a finger on the face in the camera app until it says locked.",
            _names([r for r in records if abs(np.log(r.gain)).max() > np.log(DRIFT_RATIO) / 2]),
        )


def _sharpness(records: list[FrameRecord], dropped: list[str], count: int, shots: str, report: Reporter) -> None:
    if np.median([r.blur for r in records]) > BLURRED_CRETE:
        report.finding(
            "The face is blurred in most of the capture, by motion or out of focus: no pores and a rough shape.",
            "Move slowly, film in more light so that each frame is short, wipe the lens, and hold a finger "
            "on the face to lock the focus.",
            _names([r for r in records if r.blur > BLURRED_CRETE]),
        )
    elif len(dropped) > 0.1 * (count + len(dropped)):
        report.finding(
            f"{len(dropped)} of {count + len(dropped)} {shots} are blurred and were left out.",
            "Move more slowly, and film in more light.",
            dropped,
        )
    soft = [r for r in records if r.blur > BLURRED_CRETE]
    if soft and shots == "photographs" and len(soft) < len(records) / 2:
        report.finding(
            f"{len(soft)} of {count} photographs {'is' if len(soft) == 1 else 'are'} blurred: "
            f"{name_some([r.shown for r in soft])}.",
            "Take them again with the focus on the face.",
            _names(soft),
        )


def _names(records: list[FrameRecord]) -> list[str]:
    return [r.name for r in records]


def _noise(luma: np.ndarray) -> float:
    """Return the deviation of the noise in the smoother half of a picture, by the median.

    Immerkaer, "Fast Noise Variance Estimation", 1996.
    """
    laplacian = np.abs(cv2.filter2D(luma, -1, np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)))
    smooth = cv2.GaussianBlur(luma, (0, 0), 1.5)
    slope = np.abs(cv2.Sobel(smooth, cv2.CV_32F, 1, 0)) + np.abs(cv2.Sobel(smooth, cv2.CV_32F, 0, 1))
    return float(1.4826 * np.median(laplacian[slope <= np.median(slope)]) / 6)
