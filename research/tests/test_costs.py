# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A stage's cost is measured on its own processes."""

from core.capture.capture import Capture
from research.benchmarks.costs import VIDEO, measure_stage


def test_a_stage_is_measured_with_the_processes_that_it_starts(tmp_path):
    cost = measure_stage(tmp_path / "a.wildcap", "frames", VIDEO, settings={"frames": {"max_frames": 4}})
    assert cost["processor_s"] > 1 and cost["peak_mb"] > 200, "the worker's, with its libraries"
    assert Capture(tmp_path / "a.wildcap").frames_json.is_file()


def test_a_stage_that_fails_says_why(tmp_path):
    assert "capture.mp4" in measure_stage(tmp_path / "a.wildcap", "frames", tmp_path / "capture.mp4")["problem"]
