# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several faces in one .blend: a dropped video, a capture opened, the sample head; what a head was made from, each gone
with one Ctrl-Z; Save As keeps the links, and folders that were moved are found by one click, or shown in the file
browser."""

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
    yield from sample_head_beside()
    yield from save_as(home, root)
    yield from moved_along(home, root)
    yield from moved_away(home, root)


def drop(home: Path):
    """A video dropped on the tab, by the operator that Blender calls for it: a capture with accents and spaces in its
    name, ready for its large button."""
    video = home / "Mein Gesicht é.mp4"
    video.write_bytes(b"no video yet")
    with d.in_view('UI'):
        bpy.ops.wm.drop_import_file('INVOKE_DEFAULT', directory=str(home), files=[{"name": video.name}])
    yield 1.0
    d.screenshot("first_1_drop_menu")
    yield from d.key('C')  # Blender asks: a reference, or Choose Video
    yield from d.until(lambda: len(items()) == 1, "the dropped video's capture", 10)
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


def sample_head_beside():
    """A third face; the row of the list that is chosen is the tab's face, and so is the head that is made active."""
    bpy.ops.wildcap.open_sample_head()
    yield 1.5
    assert len(items()) == 3
    for index, name in ((1, "other face"), (0, "Mein Gesicht é"), (2, "sample_head")):
        bpy.context.scene.wildcap.active_index = index
        yield 0.5
        assert addon.module("captures").active(bpy.context).name == name
    bpy.context.view_layer.objects.active = bpy.data.objects["other face"]
    yield 0.5
    assert addon.module("captures").active(bpy.context).name == "other face"
    d.screenshot("first_4_three_faces")
    d.say("three faces in one .blend")


def save_as(home: Path, root: Path):
    """The project is saved, and saved again elsewhere: its captures are found from both."""
    (home / "two").mkdir()
    for blend in (home / "project.blend", home / "two" / "copy.blend"):
        bpy.ops.wm.save_as_mainfile(filepath=str(blend))
        bpy.ops.wm.open_mainfile(filepath=str(blend))
        yield 1.5
        yield from d.open_tab("WildCap")
        assert [Path(item.path).is_dir() for item in items()] == [True] * 3, [item.path for item in items()]
        assert Path(items()[1].path) == root
    d.say("Save As keeps the links")


def moved_along(home: Path, root: Path):
    """The folder now lies beside the .blend: the large button finds it without a question."""
    new = home / "two" / root.name
    shutil.move(root, new)
    yield from missed()
    d.screenshot("first_5_missing")
    yield from d.lead("wildcap.locate_capture")
    assert Path(items()[1].path) == new and bpy.data.objects["other face"]["wildcap_capture"] == str(new)
    d.say("a folder that moved beside the .blend is found by one click")


def moved_away(home: Path, root: Path):
    """The folder is where nobody looks: the file browser opens, and it is shown there."""
    (home / "far" / "away").mkdir(parents=True)
    new = home / "far" / "away" / root.name
    shutil.move(home / "two" / root.name, new)
    yield from missed()
    yield from d.lead("wildcap.locate_capture")
    yield from d.browse(new)
    assert Path(items()[1].path) == new, items()[1].path
    yield 1.5
    yield from d.park()
    d.screenshot("first_6_located")
    assert addon.module("status").of(items()[1]).missing is False
    d.say("a folder that moved elsewhere is shown in the file browser")


def missed():
    """The tab of that face says that its folder is gone."""
    bpy.context.view_layer.objects.active = bpy.data.objects["other face"]
    status = addon.module("status")
    yield from d.until(
        lambda: status.of(items()[1]) is not None and status.of(items()[1]).missing, "that it is missed", 10
    )
    yield from d.park()


def items():
    return bpy.context.scene.wildcap.captures


def seen_in_view() -> set[str]:
    with d.in_view():
        return {thing.name for thing in bpy.context.visible_objects}


def names() -> set[str]:
    return {thing.name for thing in bpy.context.scene.objects}
