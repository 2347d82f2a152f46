# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawn glasses lie where pairs lie, and a plane separates them from bare faces."""

from pathlib import Path

import numpy as np
import pycolmap
import pytest

from core.face import template
from core.geometry.views import View
from research.people.lifelike import glasses
from research.training import glasses as training


@pytest.mark.parametrize("kind", glasses.KINDS)
def test_a_drawn_pair_stands_before_the_eyes_and_rests_on_the_ears(kind):
    landmarks = template.landmark_points(template.load())
    for seed in range(5):
        pair = glasses.sample_glasses(landmarks, np.random.default_rng(seed), kind)
        eyes = [landmarks[list(corners)].mean(0) for corners in glasses.EYES]
        for rim, eye in zip(pair.rims, eyes, strict=True):
            low, high = rim.min(0), rim.max(0)
            within = (low[[0, 2]] < eye[[0, 2]]) & (eye[[0, 2]] < high[[0, 2]])
            assert within.all(), "the pupil lies within its rim"
            assert 0.008 < eye[1] - rim[:, 1].mean() < 0.03, "and behind it"
        for temple, ear in zip(pair.bars[-2:], glasses.SIDES, strict=True):
            assert np.linalg.norm(temple[-1] - landmarks[ear]) < 0.05


def test_what_lies_behind_the_head_is_not_drawn():
    """From behind a wall only the nearer things show: a depth of nothing before the glasses leaves them whole, one of a
    wall before them takes them away."""
    landmarks = template.landmark_points(template.load())
    pair = glasses.sample_glasses(landmarks, np.random.default_rng(0), "thick")
    camera = pycolmap.Camera(model="PINHOLE", width=200, height=200, params=[300, 300, 100, 100])
    view = View("", Path(), camera, np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), np.array([0, 0, 0.4]), True)
    bare = np.full((200, 200, 3), 0.5, np.float32)
    shown = [
        glasses.put_on(bare, view, np.full((200, 200), depth), pair, 1.0, np.random.default_rng(1))
        for depth in (9.0, 0.1)
    ]
    pixels, _ = view.project(np.concatenate(pair.rims))
    rows, columns = pixels.astype(int).T[::-1]
    assert shown[0][rows, columns].mean() < 0.35, "black rims where the rims project"
    assert shown[1][rows, columns].mean() > 0.35, "hidden ones leave their lenses at most"


def test_the_plane_parts_what_can_be_parted():
    rng = np.random.default_rng(0)
    described, worn = rng.normal(size=(300, 12)), np.arange(300) % 2 == 0
    described[:, 3] += 3.0 * worn
    plane, offset = training.fit(described, worn)
    assert np.abs(plane).argmax() == 3 and ((described @ plane + offset > 0) == worn).mean() > 0.9
