# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of a capture is looked up beside Blender's own thread."""

import threading

import pytest

from tests.fixtures import standin
from tests.fixtures.polled_jobs import wait

bpy = pytest.importorskip("bpy")


def test_a_look_at_a_capture_holds_nobody_up(addon, item, monkeypatch):
    status, threads = addon("status"), []
    status._known.clear()
    assert status.of(item) is None
    look = status.look
    monkeypatch.setattr(status, "look", lambda *given: threads.append(threading.current_thread()) or look(*given))
    wait(lambda: status._tick() and status.of(item) is not None)
    assert status.of(item).has_head and len(threads) == 1 and threads[0] is not threading.main_thread()
    status._tick()
    assert len(threads) == 1, "nothing changed, nothing is looked at"


def test_only_what_the_tab_is_about_is_looked_at_again(addon, capture, tmp_path, monkeypatch):
    status, strip = addon("status"), addon("capture.strip")
    if not bpy.context.window_manager.windows:
        pytest.skip("no window in this Blender: the flows in a window hold it")
    for name in ("anna", "berta"):
        bpy.ops.wildcap.open_capture(directory=str(standin.make(tmp_path / f"{name}.wildcap")))
    items = bpy.context.scene.wildcap.captures
    stamped, in_strip, stamp, look = [], [], status._stamp, strip.look
    monkeypatch.setattr(status, "_stamp", lambda folder, text: stamped.append(folder.root.stem) or stamp(folder, text))
    monkeypatch.setattr(strip, "look", lambda root: in_strip.append(root) or look(root))
    strip._wanted.clear()  # of other tests
    for item in items:
        status.of(item), strip.of(item)

    def tick() -> list[str]:
        stamped.clear(), in_strip.clear()
        status._tick(), strip._tick()
        for thread in threading.enumerate():
            if thread.name == "wildcap-status":
                thread.join()
        return sorted(stamped)

    assert tick() == ["anna", "berta", "head"] and len(in_strip) == 3, "each that was asked for, once"
    for _ in range(2):
        assert tick() == ["berta"] and len(in_strip) == 1, "the active one"
    bpy.context.scene.wildcap.active_index = 0
    status.of(items[0])
    tick()
    assert tick() == ["head"]
