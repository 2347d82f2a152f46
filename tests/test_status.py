# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of a capture is looked up beside Blender's own thread."""

import threading
import time

import pytest

bpy = pytest.importorskip("bpy")


def test_a_look_at_a_capture_holds_nobody_up(addon, capture, monkeypatch):
    status, captures = addon("status"), addon("captures")
    item = captures.active(bpy.context)
    status._known.clear()
    assert status.of(item) is None
    look, threads = status.look, []
    monkeypatch.setattr(status, "look", lambda *given: threads.append(threading.current_thread()) or look(*given))
    for _ in range(500):
        status._tick()
        if status.of(item) is not None:
            break
        time.sleep(0.01)
    assert status.of(item).has_head and len(threads) == 1 and threads[0] is not threading.main_thread()
    status._tick()
    assert len(threads) == 1, "nothing changed, nothing is looked at"
