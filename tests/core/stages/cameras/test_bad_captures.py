# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad captures end in the right diagnosis: a head that turns, which is known in seconds, a side that is missing, mirrored
pictures, three photographs, a talking subject."""

from dataclasses import replace

import numpy as np
import pytest

from core.capture.capture import Capture
from core.capture.frame_records import PHOTOGRAPHS, VIDEO, FrameRecord, Frames
from core.capture.messages import Problem, Reporter
from core.face import faces, template
from core.geometry.views import read_views
from core.imaging import images
from core.settings.settings import Settings, from_json
from core.stages import cameras, frames
from core.stages.cameras import coverage, solving
from core.stages.cameras.mirrored import find_mirrored
from core.stages.cameras.motion import expression_changes
from core.stages.cameras.surroundings import MOST_FRAMES, spread_over, surroundings_stay
from research.people import painted_head
from research.people.painted_head import photograph, place_camera

REPORT = Reporter("cameras")


def solve(folder, views: list, pictures=None, **settings) -> tuple[Capture, Reporter]:
    """The capture of photographs of the person by these cameras, or of other pictures, and what is said of it."""
    for i, view in enumerate(views):
        picture = pictures[i] if pictures else painted_head.photograph(view, wall=False)
        images.write_srgb(folder / "photos" / f"{i}.png", picture)
    capture, report, chosen = Capture(folder / "face.wildcap"), Reporter("cameras"), from_json({"cameras": settings})
    capture.root.mkdir()
    capture.set_source(folder / "photos")
    frames.run(capture, chosen, Reporter("frames"))
    cameras.run(capture, chosen, report)
    return capture, report


def photographs(folder, azimuths, flips, scale=1.0, wall=True) -> list[str]:
    """The names of photographs, mirrored where the flip is -1."""
    names = [f"{i}.png" for i in range(len(azimuths))]
    for name, azimuth, flip in zip(names, azimuths, flips, strict=True):
        picture = painted_head.photograph(place_camera(azimuth, 0.02, scale=scale), wall=wall)
        images.write_srgb(folder / name, picture[:, ::flip])
    return names


def problems(report: Reporter) -> str:
    return " ".join(finding["problem"] for finding in report.findings)


def missing(azimuths, elevations) -> str:
    """What is said of cameras 0.5 m from the head."""
    a, e = np.radians(np.array(azimuths, float)), np.radians(elevations)
    places = 0.5 * np.stack([np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), np.sin(e)], -1)
    return " ".join(problem for problem, _ in coverage.missing(places))


def test_missing_sides_are_named():
    uneven = 10 * np.sin(np.linspace(-75, 75, 16))
    assert missing(np.linspace(-75, 75, 16), uneven) == ""
    left = missing(np.linspace(-75, 15, 10), uneven[:10])
    assert "left side: the pictures end 15 degrees" in left and "right" not in left
    right = missing(np.linspace(10, 80, 10), uneven[:10])
    assert "right side" in right and "before the nose" in right
    gap = missing([-70, -60, -50, 40, 55, 70], uneven[:6])
    assert "50 degrees to the person's right and 40 degrees to the person's left" in gap and "90 degrees" in gap
    assert "one height" in missing(np.linspace(-75, 75, 16), np.zeros(16))


def test_three_photographs_give_cameras_and_say_that_they_are_rough(tmp_path):
    """Nothing but the face to go by: before a wall without structure."""
    _, report = solve(tmp_path, [place_camera(azimuth, 0.02) for azimuth in (-38, 0, 38)], features="face")
    assert report.figures["frames_registered"] == 3 and report.figures["features"] == "face"
    assert report.figures["angular_coverage_deg"] == pytest.approx(76, abs=12)
    assert "to ten degrees or so" in problems(report) and "gap" in problems(report)


def test_a_mirrored_photograph_is_named(tmp_path):
    names = photographs(tmp_path, (-18, -6, 6, 18), (1, 1, -1, 1))
    for first, others, mirrored in (
        (names, [], ["2.png"]),
        (names[2:], names[:2], ["2.png"]),
        (["0.png", "1.png", "3.png"], [], []),
    ):
        assert find_mirrored(first, others, tmp_path, REPORT) == mirrored


def test_the_two_sides_of_a_symmetric_face_are_not_taken_for_each_others_mirror_image(tmp_path):
    # from the right, and as if from the left
    names = photographs(tmp_path, (-30, -28, -33), (1, -1, -1), scale=1.6, wall=False)
    found = {name: faces.detect(images.read_srgb(tmp_path / name)) for name in names}
    assert find_mirrored(names, [], tmp_path, REPORT) == ["0.png"], "by the pictures alone it is one"
    assert find_mirrored(names, [], tmp_path, REPORT, found) == []


def test_a_head_that_turns_before_a_still_camera_is_told(tmp_path):
    views, turns = [place_camera(0, 0.03)] * 5, np.linspace(-20, 20, 5)
    pictures = [painted_head.photograph(views[0], turned_deg=turn) for turn in turns]
    _, report = solve(tmp_path, views, pictures, features="plain")
    assert "The head turned while the camera stood still" in problems(report)
    assert report.figures["angular_coverage_deg"] == pytest.approx(40, abs=10)


@pytest.mark.parametrize(("stood", "word"), [(True, "stood still"), (False, "background")])
def test_a_head_that_moved_and_does_not_tell_its_own_motion_is_refused(stood, word):
    film = Frames(tuple(FrameRecord(name=f"{i}.jpg", sharpness=1.0, selected=True) for i in range(9)), VIDEO)
    problem = solving._explained(film, ["Nothing fits."], {}, True, stood, None, REPORT)
    assert word in problem.problem and "move the camera instead" in problem.remedy


def test_an_open_mouth_in_some_frames_is_told():
    face = faces.detect(painted_head.photograph(place_camera(0)))
    rng = np.random.default_rng(0)
    found = {
        str(i): replace(face, landmarks=face.landmarks + rng.normal(0, 0.3, face.landmarks.shape).astype(np.float32))
        for i in range(10)
    }
    assert expression_changes(found) == []
    wide = face.landmarks.copy()
    wide[14, 1] += 0.3 * np.linalg.norm(wide[33] - wide[263])  # the lower lip goes down
    found["7"] = replace(face, landmarks=wide)
    assert expression_changes(found) == ["7"]


@pytest.mark.parametrize(("azimuths", "features"), [((8,), "auto"), ((2, 10), "face")])
def test_one_photograph_or_two_make_a_draft(tmp_path, azimuths, features):
    """Nothing matches, and where a single side is seen the depths are those of other heads: the face lies on the
    picture, in metres by the distance of the pupils."""
    views = [place_camera(azimuth, 0.02) for azimuth in azimuths]
    capture, report = solve(tmp_path, views, features=features)
    assert report.figures["frames_registered"] == len(azimuths) and "overlap" not in problems(report)
    head = template.landmark_points(painted_head.person()[0].mesh)
    for placed, true in zip(read_views(capture), views, strict=True):
        there, here = (each.project(head)[0] for each in (true, placed))
        miss = np.linalg.norm(there - here, axis=1)[template.landmark_weights() > 0.2]
        assert np.median(miss) < 0.04 * np.ptp(there[:, 0]), "of the face's width"


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
