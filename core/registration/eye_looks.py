# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which frames see an eye well, and what the eye reader sees in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..contract.messages import Reporter
from ..face.eye_reader import EyeShares, read_eye
from ..face.faces import LEFT_EYE, RIGHT_EYE, Eye, shows_eye
from ..geometry.views import View
from ..imaging import images
from .landmarks import Landmarks


@dataclass(frozen=True)
class EyeLook:
    """A view that shows one eye, and what the eye reader saw in it; shares.move takes the view's own pixels to the
    crop."""

    view: View
    shares: EyeShares


def usable(sights: list[tuple[float, Eye]], side: int) -> list[int]:
    """Which sights (yaw of the head in degrees, eye) of the left (0) or right (1) eye hold: it is not beyond the nose,
    and as open as it usually is."""
    there = [i for i, (yaw, _) in enumerate(sights) if shows_eye(yaw, side)]
    usual = float(np.median([sights[i][1].opening for i in there])) if there else 0.0
    return [i for i in there if sights[i][1].is_open_as(usual)]


def look(views: list[View], landmarks: Landmarks, report: Reporter) -> tuple[list[EyeLook], list[EyeLook]]:
    """The left and the right eye as the reader sees them in the views that show them well."""
    seen = [view for view in views if view.name in landmarks.eyes]
    use = [usable([(landmarks.eyes[view.name][0], landmarks.eyes[view.name][2 - side]) for view in seen], side)
           for side in (0, 1)]  # the right eye stands first there
    looks: tuple[list[EyeLook], list[EyeLook]] = [], []
    for number, view in enumerate(seen):
        if number not in use[0] + use[1]:
            continue
        report.check()
        srgb = images.read_srgb(view.path)
        shrink = np.array([srgb.shape[1] / view.width, srgb.shape[0] / view.height])
        pixels = landmarks.images[view.name][0]
        for side, corners in enumerate((LEFT_EYE[::-1], RIGHT_EYE)):
            if number in use[side]:
                eye = read_eye(srgb, pixels[list(corners)] * shrink, side == 0)
                looks[side].append(EyeLook(view, EyeShares(eye.ball, eye.iris, eye.move * [*shrink, 1.0])))
    return looks
