# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames with a blink, or with lids that follow a glance: around that eye they show other skin and are left out."""

from __future__ import annotations

import numpy as np

from ...capture.capture import Capture
from ...capture.eyes_record import read_eyes
from ...capture.messages import Reporter
from ...face import faces, lids
from ...face.head import Unfolded
from ...geometry.views import View
from .projection import UnwrappedView

REACH_RADII = 1.7  # radii of the eyeball around its centre within which the skin moves with the lids
MARKS_PER_EDGE = 9  # points of a lid's edge, from corner to corner


def leave_out_blinks(
    capture: Capture, observations: list[UnwrappedView], surface: Unfolded, report: Reporter
) -> list[str]:
    """Take quality and weight from the texels around an eye in views that show it unusually open; return their names.

    How open is relative to how the head would look from there, and compared with the other frames. Nothing changes if
    the eyes were closed, or around an eye that no other view would be left for. Raises Problem for damaged records.
    """
    if not surface.head.eyes_open:
        return []
    sights = {o.name: _eyes_in(o.view) for o in observations if o.view.path.is_file()}
    left_out = set()
    for side, ball in enumerate(read_eyes(capture)):
        openings = {
            o.name: _opening(sights[o.name], o.view, surface.mesh.vertices, side)
            for o in observations
            if o.name in sights
        }
        unusual = _unusual(openings)
        near = np.linalg.norm(surface.points - ball.centre, axis=1) < REACH_RADII * ball.radius
        zone = surface.spread(near) > 0
        if not any((o.weight[zone] > 0).any() for o in observations if o.name not in unusual):
            continue
        for observation in (o for o in observations if o.name in unusual):
            observation.quality = np.where(zone, 0, observation.quality)
            observation.weight = np.where(zone, 0, observation.weight)
        left_out |= unusual
    if left_out:
        report.log(f"Left out around the eyes, for a blink or another look: {', '.join(sorted(left_out))}.")
    return sorted(left_out)


def _eyes_in(view: View) -> tuple[float, faces.Eye, faces.Eye] | None:
    """Return the head's yaw and the left and the right eye in a view's frame; None without a face."""
    srgb = view.read()
    face = faces.detect(srgb)
    return None if face is None else (face.yaw_deg, *faces.find_eyes(srgb, face)[::-1])


def _opening(sight: tuple | None, view: View, vertices: np.ndarray, side: int) -> float | None:
    """Return how far an eye is open in a frame, relative to the head's; None if seen too much from the side."""
    if sight is None or not faces.shows_eye(sight[0], side):
        return None
    upper, lower = (
        view.project(edge[np.linspace(0, len(edge) - 1, MARKS_PER_EDGE).round().astype(int)])[0]
        for edge in lids.edges(vertices, side)
    )
    return sight[1 + side].opening / max(faces.Eye(upper, lower, upper[0], 0.0).opening, 1e-3)


def _unusual(openings: dict[str, float | None]) -> set[str]:
    """Return the frames whose opening differs from the median."""
    measured = {name: opening for name, opening in openings.items() if opening is not None}
    usual = float(np.median(list(measured.values()))) if measured else 1.0
    return {name for name, opening in measured.items() if abs(opening / usual - 1) > faces.AS_OPEN_SHARE}
