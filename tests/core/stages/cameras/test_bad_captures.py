# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad captures end in the right diagnosis: a head that turns, a side that is missing, mirrored pictures, three
photographs, a talking subject."""

from dataclasses import replace

import numpy as np
import pytest

from core.capture.capture import Capture
from core.capture.frame_records import VIDEO, FrameRecord, Frames
from core.capture.messages import Reporter
from core.face import faces, template
from core.geometry.views import read_views
from core.imaging import images
from core.settings.settings import from_json
from core.stages import cameras, frames
from core.stages.cameras import coverage, solving
from core.stages.cameras.mirrored import find_mirrored
from core.stages.cameras.motion import expression_changes
from research.people import painted_head
from research.people.painted_head import place_camera

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
    names = photographs(tmp_path, (-30, -28, -33), (1, -1, -1), scale=2, wall=False)
    found = {name: faces.detect(images.read_srgb(tmp_path / name)) for name in names}
    assert find_mirrored(names, [], tmp_path, REPORT) == ["0.png"], "by the pictures alone it is one"
    assert find_mirrored(names, [], tmp_path, REPORT, found) == []


def test_a_head_that_turns_before_a_still_camera_is_told(tmp_path):
    views, turns = [place_camera(0, 0.03)] * 7, np.linspace(-24, 24, 7)
    pictures = [painted_head.photograph(views[0], turned_deg=turn) for turn in turns]
    _, report = solve(tmp_path, views, pictures, features="plain")
    assert "The head turned while the camera stood still" in problems(report)
    assert report.figures["angular_coverage_deg"] == pytest.approx(48, abs=12)


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


@pytest.mark.parametrize("azimuths", [(8,), (2, 10)])
def test_one_photograph_or_two_make_a_draft(tmp_path, azimuths):
    """Nothing matches, and where a single side is seen the depths are those of other heads: the face lies on the
    picture, in metres by the distance of the pupils."""
    views = [place_camera(azimuth, 0.02) for azimuth in azimuths]
    capture, report = solve(tmp_path, views)
    assert report.figures["frames_registered"] == len(azimuths) and "overlap" not in problems(report)
    head = template.landmark_points(painted_head.person()[0].mesh)
    for placed, true in zip(read_views(capture), views, strict=True):
        there, here = (each.project(head)[0] for each in (true, placed))
        miss = np.linalg.norm(there - here, axis=1)[template.landmark_weights() > 0.2]
        assert np.median(miss) < 0.04 * np.ptp(there[:, 0]), "of the face's width"
