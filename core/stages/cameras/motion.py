# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion of the head: against its background between two frames, and changes of expression.

Matches are COLMAP's before it chose one motion, so both motions are in them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from ...capture.frame_records import FrameRecord
from ...capture.messages import Reporter
from ...face import faces
from ...imaging import images
from .matches import Matches

TURNED_DEG = 12.0
STILL_DIAGONAL_SHARE = 0.004
"""Share of the picture's diagonal by which a background may drift in a picture of a camera on a tripod."""
LEAST_MATCHES = 20
"""Background matches that a pair needs to count."""
MOUTH, CORNERS, EYES = (13, 14), (61, 291), (33, 263)
OPENED_SHARE, SMILED_SHARE = 0.12, 0.15
"""Changes of the mouth's opening and width, as shares of the distance of the eyes' outer corners, that a net's noise
does not make."""


def camera_stood_still(matches: Matches, face_by_name: dict[str, faces.Face]) -> bool | None:
    """Return True if the background stays in place while the head turns, False if it does not.

    None if there are too few pairs to decide.
    """
    votes = []
    for (first, second), _ in matches.pairs.items():
        if (
            first not in face_by_name
            or second not in face_by_name
            or abs(face_by_name[first].yaw_deg - face_by_name[second].yaw_deg) < TURNED_DEG
        ):
            continue
        a, b = matches.between(first, second)
        behind = in_background(a, face_by_name[first]) & in_background(b, face_by_name[second])
        if behind.sum() >= LEAST_MATCHES:
            reach = STILL_DIAGONAL_SHARE * np.linalg.norm(np.concatenate([a, b]).max(0))
            votes.append(np.median(np.linalg.norm(a[behind] - b[behind], axis=1)) < reach)
    return bool(np.mean(votes) > 0.6) if len(votes) >= 2 else None


def in_background(pixels: np.ndarray, face: faces.Face) -> np.ndarray:
    """Return a mask [N] of pixels [N, 2] beside or above the head: not on face, hair, neck or shoulders."""
    x0, y0, x1, y1 = face.box
    aside = np.abs(pixels[:, 0] - (x0 + x1) / 2) > 1.3 * (x1 - x0)
    return (aside & (pixels[:, 1] < y1)) | (pixels[:, 1] < y0 - 0.7 * (y1 - y0))


def head_masks(
    face_by_name: dict[str, faces.Face], records: Sequence[FrameRecord], folder: Path, out: Path, report: Reporter
) -> None:
    """Write NAME.png into `out` for each frame of a folder: white on the head, black elsewhere.

    A frame without a face is all black. Shoulders are left out, because a turning head leaves them behind.
    """
    for index, record in enumerate(records):
        report.progress(index, len(records), "masking the head")
        width, height = images.size(folder / record.name)
        mask = np.zeros((height, width), np.float32)
        if record.name in face_by_name:
            x0, y0, x1, y1 = face_by_name[record.name].box
            w, h = x1 - x0, y1 - y0
            cv2.ellipse(
                mask,
                (round((x0 + x1) / 2), round((y0 + y1) / 2 - 0.2 * h)),
                (round(0.85 * w), round(0.8 * h)),
                0,
                0,
                360,
                1.0,
                -1,
            )
            mask[round(max(y1 + 0.05 * h, 0)) :] = 0
            person = faces.segment_person(images.read_srgb(folder / record.name)) > 0.5
            if person[round(max(y0, 0)) : round(y1), round(max(x0, 0)) : round(x1)].mean() > 0.7:
                mask *= person
        images.write_data(out / f"{record.name}.png", mask)


def expression_changes(face_by_name: dict[str, faces.Face]) -> list[str]:
    """Return names of frames whose mouth is opened or widened unlike in most; profiles are skipped."""
    names = [name for name, face in face_by_name.items() if abs(face.yaw_deg) < 30]
    if len(names) < 3:
        return []
    shape = np.array(
        [
            [_apart(face_by_name[name], pair) / _apart(face_by_name[name], EYES) for pair in (MOUTH, CORNERS)]
            for name in names
        ]
    )
    off = np.abs(shape - np.median(shape, 0)) > (OPENED_SHARE, SMILED_SHARE)
    return [name for name, change in zip(names, off.any(1), strict=True) if change]


def _apart(face: faces.Face, pair: tuple[int, int]) -> float:
    return float(np.linalg.norm(face.landmarks[pair[0]] - face.landmarks[pair[1]]))
