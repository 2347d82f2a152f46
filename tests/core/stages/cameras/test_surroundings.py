# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A film of a head that turns before a fixed camera is known for what it is in seconds, and nothing else is."""

from dataclasses import replace

import numpy as np
import pytest

from core.capture.capture import Capture
from core.capture.frame_records import PHOTOGRAPHS, VIDEO, FrameRecord, Frames
from core.capture.messages import Problem, Reporter
from core.face import faces
from core.imaging import images
from core.settings.settings import Settings
from core.stages.cameras import solving
from core.stages.cameras.surroundings import MOST_FRAMES, spread_over, surroundings_stay
from research.people.painted_head import photograph, place_camera

TURNS = -28, -14, 0, 14, 28


@pytest.mark.parametrize(
    ("turns", "wall", "stays"),
    [
        pytest.param([(0, turn) for turn in TURNS], True, True, id="the head turns"),
        pytest.param([(turn, 0) for turn in TURNS], True, False, id="the camera goes round"),
        pytest.param([(turn, 0) for turn in TURNS], False, False, id="a bare wall, which does not tell"),
        pytest.param([(0, turn) for turn in (-3, 0, 3)], True, False, id="nobody turns"),
    ],
)
def test_a_camera_that_stood_still_is_seen_in_a_few_pictures(tmp_path, turns, wall, stays):
    found = {}
    for i, (camera, head) in enumerate(turns):
        picture, path = photograph(place_camera(camera, 0.03), wall=wall, turned_deg=head), tmp_path / f"{i:05d}.jpg"
        images.write_srgb(path, picture, quality=95)
        found[path.name] = faces.detect(images.read_srgb(path))
    assert all(face is not None for face in found.values())
    assert surroundings_stay(found, tmp_path) is stays


def records(count: int) -> list[FrameRecord]:
    frame = FrameRecord(name="", sharpness=1.0, selected=False)
    return [replace(frame, name=f"{i:05d}.jpg", selected=i % 31 == 7, yaw_deg=float(i % 40)) for i in range(count)]


def test_the_frames_asked_are_spread_over_the_film_and_hold_those_of_the_texture():
    asked = spread_over(records(400))
    numbers = [int(record.name[:5]) for record in asked]
    assert numbers == sorted(numbers) and numbers[0] == 0 and numbers[-1] == 399 and max(np.diff(numbers)) <= 6
    selected = {record for record in records(400) if record.selected}
    assert selected <= set(asked) and MOST_FRAMES <= len(asked) <= MOST_FRAMES + 13
    assert spread_over(records(30)) == tuple(records(30))


@pytest.mark.parametrize(
    ("kind", "count", "stays", "asked", "alone"),
    [
        (VIDEO, 400, True, None, [True, True]),
        (VIDEO, 400, False, 400, [False, False]),
        (PHOTOGRAPHS, 400, True, 400, [False, False]),
    ],
)
def test_then_only_the_head_is_matched_and_in_fewer_frames(tmp_path, monkeypatch, kind, count, stays, asked, alone):
    """Where neither kind of features gives cameras, nor the face: the words stay those of a head that turned."""
    tried = []

    def by_features(skin, frames, capture, found, settings, report, alone=False):
        tried.append((len(frames.records), alone))
        return None, solving.Matches(), "nothing"

    monkeypatch.setattr(solving, "_by_features", by_features)
    monkeypatch.setattr(solving, "_by_face", lambda *given: (None, "no face"))
    monkeypatch.setattr(solving, "surroundings_stay", lambda found, folder: stays)
    monkeypatch.setattr(solving, "find_landmarks", lambda records, folder, report: {})
    film = Frames(tuple(replace(record, yaw_deg=None) for record in records(count)), kind)
    with pytest.raises(Problem) as problem:
        solving.solve(film, Capture(tmp_path), Settings(), Reporter("cameras"))
    assert [was for _, was in tried] == alone
    assert {number for number, _ in tried} == {asked or len(spread_over(film.records))}
    assert ("camera that stood still" in problem.value.problem) == (alone[0])
