# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which part of the person each texel shows: what the face parser says of the views that see it, averaged as the
texture is."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ...capture.messages import Reporter
from ...face import parser, template
from ...face.head import Head, Unfolded
from ...face.parts import GROWTHS
from ...geometry.views import View
from ...imaging import images
from .projection import UnwrappedView

ASKED = (*GROWTHS, "clothes")


@dataclass(frozen=True)
class PartsShown:
    """shares float32 [S, S, len(ASKED)] in [0, 1], 0 where nobody tells; judged bool [S, S]: where somebody does;
    hidden: of each view how much of what it shows at a texel is hair of the head or cloth, float32 [S, S], or None
    where the view's picture tells nothing."""

    shares: np.ndarray
    judged: np.ndarray
    hidden: list[np.ndarray | None]


def tell_parts(observations: list[UnwrappedView], surface: Unfolded, report: Reporter) -> PartsShown:
    """Asks the parser in every view. Raises Problem where its weights are damaged."""
    total = np.zeros(surface.covered.shape, np.float32)
    votes, hidden = np.zeros((*total.shape, len(ASKED)), np.float32), []
    for i, observation in enumerate(observations):
        report.progress(i, len(observations), f"telling hair from skin in {observation.name}")
        parsed = _look(observation, surface)
        if parsed is None:
            hidden.append(None)
            continue
        shares, known = parsed
        weight = observation.weight * known
        total += weight
        votes += weight[..., None] * shares
        hidden.append((shares[..., ASKED.index("hair")] + shares[..., ASKED.index("clothes")]) * known)
    return PartsShown(votes / np.maximum(total, 1e-9)[..., None], total > 0, hidden)


def _look(observation: UnwrappedView, surface: Unfolded) -> tuple[np.ndarray, np.ndarray] | None:
    """The shares of ASKED at each texel of a view, float32 [S, S, len(ASKED)], and where they are known [S, S]; None
    where nobody tells."""
    if not observation.view.path.is_file():
        return None
    srgb = observation.view.read()
    landmarks = _landmarks(srgb, observation.view, surface.head)
    if landmarks is None:
        return None
    parts = parser.parse(srgb, landmarks)
    height, width = observation.picture.shape[:2]
    at = [observation.pixels[..., k] - 0.5 for k in range(2)]
    *shares, known = (
        cv2.remap(images.resize(mask, width, height), *at, cv2.INTER_LINEAR)
        for mask in (*(parts.of(name) for name in ASKED), parts.known())
    )
    return np.stack(shares, -1), known


def _landmarks(srgb: np.ndarray, view: View, head: Head) -> np.ndarray | None:
    """Where a view's frame shows the head's landmarks [468, 2], from any side; None where one lies behind the
    camera."""
    pixels, _ = view.project(template.landmark_points(head.mesh))
    return pixels * [srgb.shape[1] / view.width, srgb.shape[0] / view.height] if np.isfinite(pixels).all() else None
