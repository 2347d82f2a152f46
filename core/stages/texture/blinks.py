# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames in which a person blinks, or looks elsewhere with lids that follow: around that eye they show other skin than
the rest, and are left out there."""

from __future__ import annotations

import numpy as np

from ...capture.capture import Capture
from ...capture.eyes_record import Eyeball, read_eyes
from ...capture.messages import Reporter
from ...face import faces, lids
from ...face.head import Unfolded
from ...geometry.views import View
from .projection import UnwrappedView

REACH_RADII = 1.7
"""Radii of the eyeball around its centre within which the skin moves with the lids."""
MARKS_PER_EDGE = 9  # points of a lid's edge, from corner to corner


def leave_out_blinks(
    capture: Capture, observations: list[UnwrappedView], surface: Unfolded, report: Reporter
) -> list[str]:
    """Takes quality and weight from the texels around an eye in the views whose frame shows it more or less open than
    the head would look there, next to what the other frames show.

    Nothing is done where the eyes were closed, and around an eye that no other view would be left for.

    Parameters
    ----------
    capture : with the eyes' record
    observations : of the views; change
    surface : of the head, unfolded at their size
    report : hears of it

    Returns
    -------
    The names of these views.

    Raises
    ------
    Problem
        For damaged records.
    """
    if not surface.head.eyes_open:
        return []
    eyes = read_eyes(capture)
    seen = {
        observation.name: _eyes_in(observation.view) for observation in observations if observation.view.path.is_file()
    }
    left_out = set()
    for side, ball in enumerate(eyes):
        unlike = differing(
            {
                o.name: _opening(seen[o.name], o.view, surface.mesh.vertices, side)
                for o in observations
                if o.name in seen
            }
        )
        zone = surface.spread(_around(surface, ball)) > 0
        if not any((o.weight[zone] > 0).any() for o in observations if o.name not in unlike):
            continue
        for observation in (o for o in observations if o.name in unlike):
            observation.quality = np.where(zone, 0, observation.quality)
            observation.weight = np.where(zone, 0, observation.weight)
            left_out.add(observation.name)
    if left_out:
        report.log(f"Left out around the eyes, for a blink or another look: {', '.join(sorted(left_out))}.")
    return sorted(left_out)


def _eyes_in(view: View) -> tuple[float, faces.Eye, faces.Eye] | None:
    """The head's yaw and the left and the right eye in a view's frame; None where no face is found."""
    srgb = view.read()
    face = faces.detect(srgb)
    return None if face is None else (face.yaw_deg, *faces.find_eyes(srgb, face)[::-1])


def _opening(eye_sight: tuple | None, view: View, vertices: np.ndarray, side: int) -> float | None:
    """How far an eye is open in a view's frame, over how far the head's looks open from there; None where it is seen
    too much from the side."""
    if eye_sight is None or not faces.shows_eye(eye_sight[0], side):
        return None
    upper, lower = (
        view.project(edge[np.linspace(0, len(edge) - 1, MARKS_PER_EDGE).round().astype(int)])[0]
        for edge in lids.edges(vertices, side)
    )
    return eye_sight[1 + side].opening / max(faces.Eye(upper, lower, upper[0], 0.0).opening, 1e-3)


def differing(openings: dict[str, float | None]) -> list[str]:
    """The frames whose opening is another than the usual one."""
    known = {name: opening for name, opening in openings.items() if opening is not None}
    usual = float(np.median(list(known.values()))) if known else 1.0
    return [name for name, opening in known.items() if abs(opening / usual - 1) > faces.AS_OPEN_SHARE]


def _around(surface: Unfolded, ball: Eyeball) -> np.ndarray:
    return (np.linalg.norm(surface.points - ball.centre, axis=1) < REACH_RADII * ball.radius).astype(np.float32)
