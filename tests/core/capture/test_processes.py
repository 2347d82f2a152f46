# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Processes as records name them, and whether they still run."""

import ctypes
import os
from types import SimpleNamespace

import pytest

from core.capture import processes
from tests.fixtures.kept_capture import NO_PROCESS


def test_processes_are_told_apart():
    me = processes.identify_process()
    assert not processes.is_gone(me) and processes.is_at_work(me)
    assert processes.is_gone({**me, "began": "another time"}) and processes.is_gone({**me, "pid": NO_PROCESS})
    assert processes.is_gone({**me, "pid": -1}) and processes.is_gone({**me, "pid": 0}), "to kill(2), many at once"
    container = {**me, "pid": NO_PROCESS, "host": processes.name_host() + "0"}
    assert not processes.is_gone(container) and not processes.is_at_work(container), "a number there means nothing here"
    elsewhere = {**me, "host": "another machine"}
    assert not processes.is_gone(elsewhere) and not processes.is_at_work(elsewhere)


def test_a_process_whose_beginning_is_not_told_is_neither_gone_nor_known_to_be_at_work(monkeypatch):
    """Of another user, where those cannot look at one another's."""
    other = {**processes.identify_process(), "pid": os.getppid()}
    monkeypatch.setattr(processes, "_ask_beginning", lambda pid: "")
    assert not processes.is_gone(other) and not processes.is_at_work(other)


@pytest.mark.parametrize(
    ("handle", "error", "code", "told"),
    [
        (7, 0, processes.STILL_ACTIVE, ("3:4", True)),
        (7, 0, 1, ("3:4", False)),  # killed, and whoever started it still holds it
        (0, processes.ACCESS_DENIED, 0, ("", True)),  # another user's
        (0, 87, 0, ("", False)),
    ],  # the last: nobody's number
)
def test_windows_is_asked_whether_a_process_has_ended(monkeypatch, handle, error, code, told):
    closed = []

    def times(handle, began, *_) -> int:
        began._obj.dwHighDateTime, began._obj.dwLowDateTime = 3, 4
        return 1

    def exit_code(handle, place) -> int:
        place._obj.value = code
        return 1

    def open_process(access, inherit, pid) -> int:
        assert (access, pid) == (processes.QUERY_LIMITED_INFORMATION, 4711)
        return handle

    kernel = SimpleNamespace(
        OpenProcess=open_process,
        GetProcessTimes=times,
        GetExitCodeProcess=exit_code,
        CloseHandle=lambda handle: closed.append(handle.value),
    )
    monkeypatch.setattr(ctypes, "WinDLL", lambda name, use_last_error: kernel, raising=False)
    monkeypatch.setattr(ctypes, "get_last_error", lambda: error, raising=False)
    assert processes._ask_windows(4711) == told and closed == ([handle] if handle else [])
