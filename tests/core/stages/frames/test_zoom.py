# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A zoom or a switch of lenses in a film is found from neighbouring frames, and a walking camera is none."""

import cv2
import numpy as np
import pytest

from core.stages.frames.zoom import features_of, zooms_of

SCENE = cv2.resize(np.random.default_rng(5).random((90, 120, 3), np.float32), (960, 720), interpolation=cv2.INTER_CUBIC)


def shot(zoom: float, shift: float, turn: float = 0.0) -> np.ndarray:
    """A frame [480, 640, 3] of the middle of the scene."""
    matrix = cv2.getRotationMatrix2D((480 + shift, 360), turn, zoom)
    matrix[:, 2] += (-160 - shift, -120)
    return cv2.warpAffine(SCENE, matrix, (640, 480), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)


@pytest.mark.parametrize(
    "course",
    [
        [1.0] * 12,
        [1.0] * 6 + [1.5] * 6,
        [1.0] * 6 + [0.6] * 6,
        [1.0] * 4 + [2.0] * 4 + [1.0] * 4,
        [1.0] * 4 + [1.4] * 4 + [1.9] * 4,
    ],
    ids=["none", "in", "out", "there and back", "twice"],
)
def test_each_part_of_a_film_has_its_zoom(course):
    frames = [shot(zoom, 6 * i, 0.5 * i) for i, zoom in enumerate(course)]
    zooms = zooms_of([features_of(frame) for frame in frames])
    assert zooms == pytest.approx(course, rel=0.03)
    assert len(set(zooms)) == len(set(course)), "one lens is one zoom"


def test_a_camera_that_steps_nearer_and_frames_that_show_nothing_are_no_zoom():
    nearer = [shot(1.06**i, 4 * i) for i in range(12)]
    assert zooms_of([features_of(frame) for frame in nearer]) == [1.0] * 12
    blank = np.full((480, 640, 3), 0.5, np.float32)
    assert zooms_of([features_of(frame) for frame in (nearer[0], blank, nearer[0])]) == [1.0] * 3
    assert zooms_of([]) == []
