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


def place(azimuth_deg, elevation_deg=0.0) -> np.ndarray:
    a, e = np.radians(azimuth_deg), np.radians(elevation_deg)
    return 0.5 * np.stack([np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), np.sin(e) * np.ones_like(a)], -1)


def solve(folder, capture: Capture, **settings) -> Reporter:
    capture.root.mkdir(parents=True, exist_ok=True)
    capture.set_source(folder)
    chosen = from_json({"cameras": settings})
    frames.run(capture, chosen, Reporter("frames"))
    report = Reporter("cameras")
    cameras.run(capture, chosen, report)
    return report


def problems(report: Reporter) -> str:
    return " ".join(finding["problem"] for finding in report.findings)


def missing(azimuths, elevations) -> str:
    return " ".join(problem for problem, _ in coverage.missing(place(np.array(azimuths, float), np.array(elevations))))


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
    """Nothing but the face to go by: sixty degrees apart, before a wall without structure."""
    for i, azimuth in enumerate((-38, 0, 38)):
        picture = painted_head.photograph(place_camera(azimuth, 0.02), wall=False)
        images.write_srgb(tmp_path / "photos" / f"{i}.png", picture)
    report = solve(tmp_path / "photos", Capture(tmp_path / "face.wildcap"), features="face")
    assert report.figures["frames_registered"] == 3 and report.figures["features"] == "face"
    assert report.figures["angular_coverage_deg"] == pytest.approx(76, abs=12)
    assert "to ten degrees or so" in problems(report) and "gap" in problems(report)


def test_a_mirrored_photograph_is_named(tmp_path):
    names = [f"{i}.png" for i in range(4)]
    for name, azimuth, flip in zip(names, (-18, -6, 6, 18), (1, 1, -1, 1), strict=True):
        images.write_srgb(tmp_path / name, painted_head.photograph(place_camera(azimuth, 0.02))[:, ::flip])
    assert find_mirrored(names, [], tmp_path, Reporter("cameras")) == ["2.png"]
    assert find_mirrored(["2.png", "3.png"], ["0.png", "1.png"], tmp_path, Reporter("cameras")) == ["2.png"]
    assert find_mirrored(["0.png", "1.png", "3.png"], [], tmp_path, Reporter("cameras")) == []


def test_the_two_sides_of_a_symmetric_face_are_not_taken_for_each_others_mirror_image(tmp_path):
    names, found = [f"{i}.png" for i in range(3)], {}
    # from the right, and as if from the left
    for name, azimuth, flip in zip(names, (-30, -28, -33), (1, -1, -1), strict=True):
        images.write_srgb(
            tmp_path / name, painted_head.photograph(place_camera(azimuth, 0.02, scale=2), wall=False)[:, ::flip]
        )
        found[name] = faces.detect(images.read_srgb(tmp_path / name))
    assert find_mirrored(names, [], tmp_path, Reporter("cameras")) == ["0.png"], "by the pictures alone it is one"
    assert find_mirrored(names, [], tmp_path, Reporter("cameras"), found) == []


def test_a_head_that_turns_before_a_still_camera_is_told(tmp_path):
    for i, turn in enumerate(np.linspace(-24, 24, 7)):
        picture = painted_head.photograph(place_camera(0, 0.03), turned_deg=turn)
        images.write_srgb(tmp_path / "photos" / f"{i}.png", picture)
    report = solve(tmp_path / "photos", Capture(tmp_path / "face.wildcap"), features="plain")
    assert "The head turned while the camera stood still" in problems(report)
    assert report.figures["angular_coverage_deg"] == pytest.approx(48, abs=12)


@pytest.mark.parametrize(("stood", "word"), [(True, "stood still"), (False, "background")])
def test_a_head_that_moved_and_does_not_tell_its_own_motion_is_refused(stood, word):
    film = Frames(tuple(FrameRecord(name=f"{i}.jpg", sharpness=1.0, selected=True) for i in range(9)), VIDEO)
    problem = solving._explained(film, ["Nothing fits."], {}, True, stood, None, Reporter("cameras"))
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
    for i, azimuth in enumerate(azimuths):
        picture = painted_head.photograph(place_camera(azimuth, 0.02), wall=False)
        images.write_srgb(tmp_path / "photos" / f"{i}.png", picture)
    capture = Capture(tmp_path / "face.wildcap")
    report = solve(tmp_path / "photos", capture)
    assert report.figures["frames_registered"] == len(azimuths) and "overlap" not in problems(report)
    head = template.landmark_points(painted_head.person()[0].mesh)
    for view, azimuth in zip(read_views(capture), azimuths, strict=True):
        there, here = (each.project(head)[0] for each in (place_camera(azimuth, 0.02), view))
        miss = np.linalg.norm(there - here, axis=1)[template.landmark_weights() > 0.2]
        assert np.median(miss) < 0.04 * np.ptp(there[:, 0]), "of the face's width"
