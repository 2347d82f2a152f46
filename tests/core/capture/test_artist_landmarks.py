# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Landmarks put by hand: their file, the command line, and that they win over the frames and the scan."""

import json

import numpy as np
import pytest

from core import __main__ as cli
from core.capture import artist_landmarks, stages
from core.capture.capture import Capture
from core.capture.files import write_json
from core.capture.messages import Problem, Reporter
from core.geometry import meshes
from core.settings.settings import Settings, from_json
from core.stages import registration
from tests.fixtures.recorded import changed, record
from tests.fixtures.scanned_head import known, scanned

MOUTH_CORNER = 61


@pytest.fixture
def capture(tmp_path):
    capture = Capture(tmp_path / "Zoë.wildcap")
    write_json(capture.json, {"format": 2, "source": "", "stages": {}})
    return capture


def test_a_point_is_set_moved_and_freed(capture, capsys):
    folder = str(capture.root)
    assert cli.main(["landmarks", "set", folder, "152", "0.001", "-0.02", "-0.11"]) == 0
    assert cli.main(["landmarks", "set", folder, "1", "0", "-0.04", "-0.04"]) == 0
    assert artist_landmarks.read(capture.landmarks_artist) == {1: (0, -0.04, -0.04), 152: (0.001, -0.02, -0.11)}
    assert cli.main(["landmarks", "free", folder, "152"]) == 0
    assert set(artist_landmarks.read(capture.landmarks_artist)) == {1}
    assert cli.main(["landmarks", "free", folder, "1"]) == 0
    assert not capture.landmarks_artist.exists()
    assert "0 landmarks" in capsys.readouterr().out


def test_points_of_a_file_are_taken(capture, tmp_path):
    other = tmp_path / "mine.json"
    other.write_text('{"points": {"4": [0, -0.05, -0.04], "152": [0, -0.02, -0.11]}}')
    assert cli.main(["landmarks", "import", str(capture.root), str(other)]) == 0
    assert set(json.loads(capture.landmarks_artist.read_text())["points"]) == {"4", "152"}
    assert cli.main(["landmarks", "import", str(capture.root), str(tmp_path / "none.json")]) == 2


@pytest.mark.parametrize(
    "text",
    [
        "not json",
        "[]",
        '{"points": [1]}',
        '{"points": {"468": [0, 0, 0]}}',
        '{"points": {"nose": [0, 0, 0]}}',
        '{"points": {"1": [0, 0]}}',
        '{"points": {"1": [0, 0, 150]}}',
        '{"points": {"1": [0, 0, NaN]}}',
        '{"points": {"1": "abc"}}',
    ],
)
def test_a_bad_file_is_a_problem_and_changes_nothing(capture, tmp_path, text):
    bad = tmp_path / "bad.json"
    bad.write_text(text)
    with pytest.raises(Problem) as caught:
        artist_landmarks.read(bad)
    assert caught.value.remedy
    assert cli.main(["landmarks", "import", str(capture.root), str(bad)]) == 2
    assert not capture.landmarks_artist.exists()
    capture.landmarks_artist.write_text(text)
    with pytest.raises(Problem):
        registration.run(capture, Settings(), Reporter("registration"))


def test_registration_is_stale_after_an_edit(capture):
    stage = stages.by_name("registration")
    record(capture, stage, Settings())
    artist_landmarks.put(capture, {1: (0, -0.04, -0.04)})
    assert changed(capture, stage, Settings()) == ("landmarks_artist.json",)
    artist_landmarks.put(capture, {1: None})
    assert changed(capture, stage, Settings()) == ()


def test_a_moved_landmark_takes_the_surface_along(tmp_path, monkeypatch):
    model, _, points, _ = known()
    capture, report = scanned(tmp_path / "c", monkeypatch), Reporter("registration")
    write_json(capture.json, {"format": 2, "source": "", "stages": {}})
    wish = points[MOUTH_CORNER] + [-0.005, 0, 0.003]
    artist_landmarks.put(capture, {MOUTH_CORNER: wish})
    registration.run(capture, from_json({"registration": {"iterations": 8}}), report)
    at = model.at_landmarks(meshes.read_obj(capture.head).vertices)
    off = np.linalg.norm(at[MOUTH_CORNER] - wish)
    assert off < 0.0007, "it is where the artist put it, not where the frames and the scan have it"
    assert report.figures["landmarks_put_by_hand"] == 1 and report.figures["put_landmark_residual_mm"] < 0.7
    far = np.linalg.norm(points - points[MOUTH_CORNER], axis=1) > 0.05
    assert np.median(np.linalg.norm(at - points, axis=1)[far]) < 0.001, "the rest of the face stays"
    assert report.figures["flipped_triangles"] == 0
    assert (
        np.linalg.norm(np.array(json.loads(capture.landmarks.read_text())["points"][str(MOUTH_CORNER)]) - wish) < 1e-5
    )
