# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which folder becomes a capture: a new one, an empty one, or one that is or was a capture; any other is refused, and
nothing in it is touched."""

import pytest

from core.capture import ownership
from core.capture.capture import Capture
from core.capture.messages import Problem
from core.worker.job import write_job
from tests.fixtures.kept_capture import contents, make, make_frames


@pytest.fixture
def capture(tmp_path) -> Capture:
    return make(tmp_path / "anna.wildcap")


def test_a_folder_that_holds_something_else_is_never_taken_over(tmp_path):
    """`core run anna/frames anna`: the folder's names look like a capture's."""
    album = tmp_path / "anna"
    (album / "frames").mkdir(parents=True)
    (album / "frames" / "holiday.jpg").write_bytes(b"a picture")
    before = contents(tmp_path)
    capture = Capture(album)
    for attempt in (
        lambda: capture.claim(),
        lambda: capture.set_source(tmp_path / "film.mp4"),
        lambda: write_job(capture),
    ):
        with pytest.raises(Problem, match="is no capture: it holds frames"):
            attempt()
    with pytest.raises(Problem, match="is no capture"), capture.locked():
        pass
    assert contents(tmp_path) == before


def test_a_capture_whose_record_was_deleted_to_start_anew_is_one_still_and_loses_nothing(capture):
    make_frames(capture, "00000.jpg")
    capture.shadow_mask.write_text("painted")
    before = contents(capture.root)
    capture.json.unlink()
    capture.claim()
    assert contents(capture.root) == before
    assert capture.read()["stages"] == {}
    for path in (capture.json, capture.root / ownership.RECORD):
        path.unlink()
    with pytest.raises(Problem, match="is no capture"):
        capture.claim()


def test_a_source_inside_the_capture_is_refused(capture):
    (capture.root / "my film.mp4").write_bytes(b"film")
    (capture.root / "frames").mkdir()
    for source in (capture.root / "my film.mp4", capture.root / "frames", capture.root):
        for attempt in (
            lambda source=source: capture.set_source(source),
            lambda source=source: write_job(capture, source=source),
        ):
            with pytest.raises(Problem, match="lies in the capture"):
                attempt()
