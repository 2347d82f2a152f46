# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Two faces in one .blend: a dropped video and a capture opened; what a head was made from, each gone with one Ctrl-Z;
and a folder that was moved, shown in the file browser."""

import shutil
from pathlib import Path

import addon
import bpy
import driver as d

from tests.fixtures import standin

LIMIT_S = 500

UNFOLDED = ("WILDCAP_PT_capture", "WILDCAP_PT_reconstruct")


def flow():
    addon.unfold(*UNFOLDED)
    home = Path.home() / "Documents"
    yield from d.open_tab("WildCap")
    yield from drop(home)
    root = yield from open_another(home)
    yield from evidence()
    yield from moved_away(home, root)


def drop(home: Path):
    """A video dropped on the tab: a capture with accents and spaces in its name, ready for its large button."""
    video = home / "Mein Gesicht é.mp4"
    video.write_bytes(b"no video yet")
    yield from addon.drop(home, video.name)
    assert Path(items()[0].path) == Path.home() / "WildCap" / "Mein Gesicht é.wildcap"
    addon.use_solver()
    yield 1.5
    assert addon.next_step().operator == "wildcap.make_my_head", addon.next_step()
    yield from d.park()
    d.screenshot("first_2_dropped")
    d.say("a dropped video became a capture")


def open_another(home: Path):
    """A capture with cameras and scan, beside the first in the list; its head comes in by the large button."""
    root = standin.make(home / "other face.wildcap", solved=False)
    standin.add_evidence(root)
    bpy.ops.wildcap.open_capture(directory=str(root))  # a file browser otherwise
    yield 1.5
    assert [item.name for item in items()] == ["Mein Gesicht é", "other face"]
    before = names()
    yield from d.lead("wildcap.bring_in_head")
    yield from d.until(lambda: names() - before == {"other face"}, "the head", 5)
    return root


def evidence():
    """Cameras and scan come in by a click, and go one at a time by Ctrl-Z, the head last; Ctrl-Shift-Z brings each
    again."""
    seen = [names()]
    for name, kind in (("cameras", 'CAMERA'), ("scan", 'MESH')):
        yield from d.press(f"wildcap.bring_in_{name}")
        yield from d.until(lambda: names() != seen[-1], name, 10)
        came = names() - seen[-1]
        assert all(bpy.data.objects[thing].type == kind for thing in came), (name, came)
        assert came | {"other face"} <= seen_in_view(), "seen beside the head in Local View"
        assert "Cube" not in seen_in_view(), "which shows nothing else"
        seen.append(names())
    d.screenshot("first_3_evidence")
    seen.insert(0, seen[0] - {"other face"})
    for keys, wanted in (({}, seen[-2::-1]), ({"shift": True}, seen[1:])):
        for things in wanted:
            yield from d.key('Z', ctrl=True, **keys)
            assert names() == things, (keys, names() ^ things)
    d.say("cameras, scan and head: one Ctrl-Z each, and back")


def moved_away(home: Path, root: Path):
    """The folder is where nobody looks: the file browser opens, and it is shown there."""
    (home / "far" / "away").mkdir(parents=True)
    new = home / "far" / "away" / root.name
    bpy.ops.wm.save_as_mainfile(filepath=str(home / "project.blend"))
    shutil.move(root, new)
    bpy.context.view_layer.objects.active = bpy.data.objects["other face"]
    status = addon.module("status")
    yield from d.until(
        lambda: status.of(items()[1]) is not None and status.of(items()[1]).missing, "that it is missed", 10
    )
    yield from d.park()
    yield from d.lead("wildcap.locate_capture")
    yield from d.browse(new)
    assert Path(items()[1].path) == new, items()[1].path
    yield 1.5
    yield from d.park()
    d.screenshot("first_4_located")
    assert status.of(items()[1]).missing is False
    d.say("a folder that moved elsewhere is shown in the file browser")


def items():
    return bpy.context.scene.wildcap.captures


def seen_in_view() -> set[str]:
    with d.in_view():
        return {thing.name for thing in bpy.context.visible_objects}


def names() -> set[str]:
    return {thing.name for thing in bpy.context.scene.objects}
