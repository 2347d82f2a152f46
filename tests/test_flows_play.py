# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How a window's flow is judged: once more where it failed, and not at all when no time is left."""

import subprocess

import pytest

from tests.gui import conftest as gui


def outcomes(monkeypatch, *codes: int) -> list:
    """Runs of run.sh end with these codes, in turn; what was asked of it is kept."""
    left, asked = list(codes), []

    def run(command, **_):
        asked.append(command[1:])
        return subprocess.CompletedProcess(command, left.pop(0), "what it said")

    monkeypatch.setattr(gui.subprocess, "run", run)
    return asked


def test_a_flow_that_passes_is_played_once(monkeypatch):
    asked = outcomes(monkeypatch, 0)
    gui.play_flow("--newest", "loop")
    assert asked == [["--newest", "loop"]]


def test_one_that_fails_once_passes_and_says_so(monkeypatch):
    asked = outcomes(monkeypatch, 1, 0)
    with pytest.warns(UserWarning, match="loop failed and is played again; it had said:\nwhat it said"):
        gui.play_flow("loop")
    assert len(asked) == 2


def test_one_that_fails_twice_fails(monkeypatch):
    outcomes(monkeypatch, 1, 1)
    with pytest.warns(UserWarning), pytest.raises(pytest.fail.Exception, match="what it said"):
        gui.play_flow("loop")


def test_without_time_it_is_skipped_but_never_a_failure(monkeypatch):
    asked = outcomes(monkeypatch)
    monkeypatch.setattr(gui, "UNTIL", 0)
    with pytest.raises(pytest.skip.Exception, match="no time is left"):
        gui.play_flow("loop")
    assert asked == []
    monkeypatch.setattr(gui, "UNTIL", 100)
    monkeypatch.setattr(gui.time, "time", iter([0, 200]).__next__)
    outcomes(monkeypatch, 1)
    with pytest.warns(UserWarning), pytest.raises(pytest.fail.Exception, match="what it said"):
        gui.play_flow("loop")
