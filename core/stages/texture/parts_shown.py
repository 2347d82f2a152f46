# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of the person at each texel: the face parser's answers in all views, averaged as the texture is."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ...capture.messages import Reporter
from ...face import parser, template
from ...face.head import Unfolded
from ...face.parts import GROWTHS
from ...imaging import images
from .projection import UnwrappedView

ASKED = (*GROWTHS, "clothes")


@dataclass(frozen=True)
class PartsShown:
    """Shares of ASKED float32 [S, S, len(ASKED)] in [0, 1], 0 where no view was parsed.

    judged: bool [S, S], where some view was; hidden: the share of head hair and cloth in each view, float32 [S, S], or
    None for a view that could not be parsed.
    """

    shares: np.ndarray
    judged: np.ndarray
    hidden: list[np.ndarray | None]


def tell_parts(observations: list[UnwrappedView], surface: Unfolded, report: Reporter) -> PartsShown:
    """Parse every view. Raises Problem if the parser's weights are damaged."""
    total = np.zeros(surface.covered.shape, np.float32)
    votes, hidden = np.zeros((*total.shape, len(ASKED)), np.float32), []
    marks = template.landmark_points(surface.head.mesh)
    for i, observation in enumerate(observations):
        report.progress(i, len(observations), f"telling hair from skin in {observation.name}")
        parsed = _parse(observation, marks)
        if parsed is None:
            hidden.append(None)
            continue
        shares, judged = parsed
        weight = observation.weight * judged
        total += weight
        votes += weight[..., None] * shares
        hidden.append((shares[..., ASKED.index("hair")] + shares[..., ASKED.index("clothes")]) * judged)
    return PartsShown(votes / np.maximum(total, 1e-9)[..., None], total > 0, hidden)


def _parse(observation: UnwrappedView, marks: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the shares of ASKED in a view, float32 [S, S, len(ASKED)], and where they are known [S, S].

    None without a frame, or if one of the head's landmarks [468, 3] lies behind the camera.
    """
    view, (height, width) = observation.view, observation.picture.shape[:2]
    landmarks, _ = view.project(marks)
    if not view.path.is_file() or not np.isfinite(landmarks).all():
        return None
    srgb = view.read()
    parts = parser.parse(srgb, landmarks * [srgb.shape[1] / view.width, srgb.shape[0] / view.height])
    at = [observation.pixels[..., k] - 0.5 for k in range(2)]
    *shares, judged = (
        cv2.remap(images.resize(mask, width, height), *at, cv2.INTER_LINEAR)
        for mask in (*(parts.of(name) for name in ASKED), parts.known())
    )
    return np.stack(shares, -1), judged
