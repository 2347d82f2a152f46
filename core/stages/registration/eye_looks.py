# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames that show an eye well, and the eye reader's result in them."""

from dataclasses import dataclass

import numpy as np

from ...capture.messages import Reporter
from ...face.eye_reader import EyeShares, read_eye
from ...face.faces import LEFT_EYE, RIGHT_EYE, Eye, shows_eye
from ...geometry.views import View
from .landmarks import Landmarks

CORNERS = (LEFT_EYE[::-1], RIGHT_EYE)
"""Landmarks at the outer and the inner corner of the left (0) and the right (1) eye."""


@dataclass(frozen=True)
class EyeLook:
    """View of one eye and the eye reader's result in it; shares.move takes the view's own pixels to the crop."""

    view: View
    shares: EyeShares


def usable(sights: list[tuple[float, Eye]], side: int) -> list[int]:
    """Return the indices of usable sights (yaw in degrees, eye) of the left (0) or right (1) eye.

    The eye is not beyond the nose, and as open as it usually is.
    """
    facing = [i for i, (yaw, _) in enumerate(sights) if shows_eye(yaw, side)]
    usual = float(np.median([sights[i][1].opening for i in facing])) if facing else 0.0
    return [i for i in facing if sights[i][1].is_open_as(usual)]


def look(views: list[View], landmarks: Landmarks, report: Reporter) -> tuple[list[EyeLook], list[EyeLook]]:
    """Read the left and the right eye in the views that show them well and whose landmarks hold."""
    use = [_names_of(views, landmarks, side) for side in (0, 1)]
    looks: tuple[list[EyeLook], list[EyeLook]] = [], []
    for view in views:
        if view.name not in use[0] | use[1]:
            continue
        report.check()
        srgb = view.read()
        shrink = np.array([srgb.shape[1] / view.width, srgb.shape[0] / view.height])
        pixels = landmarks.images[view.name][0]
        for side, corners in enumerate(CORNERS):
            if view.name in use[side]:
                eye = read_eye(srgb, pixels[list(corners)] * shrink, side == 0)
                looks[side].append(EyeLook(view, EyeShares(eye.ball, eye.iris, eye.move * [*shrink, 1.0])))
    return looks


def _names_of(views: list[View], landmarks: Landmarks, side: int) -> set[str]:
    """Return the names of the views that show an eye well."""
    names = [
        view.name
        for view in views
        if view.name in landmarks.eyes and landmarks.images[view.name][1][list(CORNERS[side])].any()
    ]
    # the right eye comes first there
    chosen = usable([(landmarks.eyes[name][0], landmarks.eyes[name][2 - side]) for name in names], side)
    return {names[i] for i in chosen}
