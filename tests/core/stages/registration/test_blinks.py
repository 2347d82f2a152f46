# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames in which somebody blinks, among others: around that eye the texture does without them, and elsewhere it does
not."""

from dataclasses import replace

import numpy as np
import pytest

from core.capture.capture import Capture
from core.capture.eyes_record import read_eyes, write_eyes
from core.capture.messages import Reporter
from core.face import faces, lids
from core.face.head import read_filmed_head, read_head
from core.geometry import meshes
from core.imaging import images
from core.stages.registration import eyeballs
from core.stages.texture import blinks
from core.stages.texture.held_picture import hold
from core.stages.texture.projection import observe
from research.people.lifelike import shape
from research.people.painted_head import place_camera

SEED, AZIMUTHS, SIZE = 4, (-20, -8, 8, 20, 70), 128


@pytest.fixture
def filmed(tmp_path, monkeypatch):
    """A capture with open eyes, five views of it, and what would be found in each: the second shuts the left eye, and
    the last is a profile."""
    capture = Capture(tmp_path / "face.wildcap")
    capture.claim()
    closed = shape.person_mesh(SEED)
    opened = lids.open_lids(closed, 0.9, np.zeros(2))
    meshes.write_obj(capture.head, closed)
    meshes.write_obj(capture.head_open, opened.skin)
    write_eyes(capture, *eyeballs.OpenEyes(closed, opened, (0.9, 0.9), np.full(2, 0.0059), (4, 4)).records())
    head = read_filmed_head(capture)
    surface, found, observations = head.unfold(SIZE), {}, []
    for i, azimuth in enumerate(AZIMUTHS):
        view = replace(place_camera(azimuth), name=f"{i}.png", path=tmp_path / f"{i}.png")
        images.write_srgb(view.path, np.full((view.height, view.width, 3), 0.5, np.float32))
        seen = []
        for side in (0, 1):
            edges = (
                edge[np.linspace(0, len(edge) - 1, 9).round().astype(int)]
                for edge in lids.edges(head.mesh.vertices, side)
            )
            seen.append(faces.Eye(*(view.project(edge)[0] for edge in edges), np.zeros(2), 0.0))
        if i == 1:
            seen[0] = replace(seen[0], upper=seen[0].lower + 0.3 * (seen[0].upper - seen[0].lower))
        if i == 4:
            seen[1] = replace(seen[1], upper=seen[1].lower)
        found[view.name] = (-azimuth, *seen)
        observations.append(observe(view, hold(np.full((view.height, view.width, 3), 0.5)), surface, 1.0))
    monkeypatch.setattr(blinks, "_eyes_in", lambda view: found[view.name])
    return capture, observations, surface


def around(surface, capture, side):
    ball = read_eyes(capture)[side]
    near = np.linalg.norm(surface.points - ball.centre, axis=1) < 1.4 * ball.radius
    return surface.spread(near.astype(np.float32)) > 0


def test_a_blink_is_left_out_around_its_eye_alone(filmed):
    capture, observations, surface = filmed
    before = [o.weight.copy() for o in observations]
    assert blinks.leave_out_blinks(capture, observations, surface, Reporter("texture")) == ["1.png"]
    left, right = (around(surface, capture, side) for side in (0, 1))
    assert before[1][left].max() > 0
    assert observations[1].weight[left].max() == observations[1].quality[left].max() == 0
    assert (observations[1].weight[right] == before[1][right]).all()
    assert (observations[1].weight > 0).sum() > 0.8 * (before[1] > 0).sum()
    for i in (0, 2, 3, 4):
        assert (observations[i].weight == before[i]).all()


def test_an_eye_keeps_what_it_has_where_no_other_view_shows_it(filmed):
    capture, observations, surface = filmed
    blind = np.zeros_like(observations[0].weight)
    only = [replace(observations[0], weight=blind), observations[1], replace(observations[2], weight=blind)]
    assert blinks.leave_out_blinks(capture, only, surface, Reporter("texture")) == []


def test_closed_eyes_do_not_blink(filmed):
    capture, observations, _ = filmed
    assert blinks.leave_out_blinks(capture, observations, read_head(capture).unfold(SIZE), Reporter("texture")) == []
