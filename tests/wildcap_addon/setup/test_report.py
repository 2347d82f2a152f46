# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Save Report in Blender, beside every problem."""

import zipfile

import pytest

from core.capture.messages import Problem
from tests.fixtures.drawn import Layout
from tests.fixtures.polled_jobs import follow

bpy = pytest.importorskip("bpy")


def test_a_report_is_saved_with_blender_s_version_and_no_name_of_the_capture(addon, capture, tmp_path):
    (capture / "logs").mkdir(exist_ok=True)
    (capture / "logs" / "solve.log").write_text(f"reading {capture}/texture.exr of Zoë et moi")
    target = tmp_path / "about it.zip"
    bpy.ops.wildcap.save_report(filepath=str(target))
    follow(addon)
    assert str(target) in addon("problems").of("").problem
    with zipfile.ZipFile(target) as archive:
        assert bpy.app.version_string in archive.read("report.json").decode()
        assert archive.read("logs/solve.log").decode() == "reading <capture>/texture.exr of <removed>"


def test_the_button_stands_beside_a_problem_and_not_beside_a_notice(addon):
    problems = addon("problems")
    for kind, operators in ((Problem, ["wildcap.save_report"]), (problems.Notice, [])):
        problems.draw(layout := Layout(), kind("It is broken.", "Mend it."), 400)
        assert layout.arguments("operator") == operators
