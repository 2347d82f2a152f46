# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Landmarks placed by hand: their file, the command line, and the stage that reads them."""

import json

import pytest

from core.__main__ import main
from core.capture import artist_landmarks
from core.capture.messages import Problem
from tests.fixtures.kept_capture import make


@pytest.fixture
def capture(tmp_path):
    return make(tmp_path / "Zoë.wildcap")


def test_set_import_and_free(capture, tmp_path, capsys):
    folder = str(capture.root)
    assert main(["landmarks", "set", folder, "152", "0.001", "-0.02", "-0.11"]) == 0
    assert main(["landmarks", "set", folder, "1", "0", "-0.04", "-0.04"]) == 0
    assert artist_landmarks.read(capture.landmarks_artist) == {1: (0, -0.04, -0.04), 152: (0.001, -0.02, -0.11)}
    (tmp_path / "mine.json").write_text('{"points": {"4": [0, -0.05, -0.04], "152": [0, -0.02, -0.11]}}')
    assert main(["landmarks", "import", folder, str(tmp_path / "mine.json")]) == 0
    assert list(json.loads(capture.landmarks_artist.read_text())["points"]) == ["1", "4", "152"]
    assert main(["landmarks", "import", folder, str(tmp_path / "none.json")]) == 2
    for index in ("152", "4", "1"):
        assert main(["landmarks", "free", folder, index]) == 0
    assert not capture.landmarks_artist.exists() and "0 landmarks" in capsys.readouterr().out


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
    bad.write_text('{"points": {}}')
    assert main(["landmarks", "import", str(capture.root), str(bad)]) == 2
    bad.write_text(text)
    with pytest.raises(Problem):
        artist_landmarks.read(bad)
    assert main(["landmarks", "import", str(capture.root), str(bad)]) == 2
    assert not capture.landmarks_artist.exists()
