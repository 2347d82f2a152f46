# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels are drawn many times a second: no `draw` or `poll` of one reads a file or a folder, starts a process or asks
the network. F3 finds all."""

import sys

import pytest

from tests.fixtures import standin
from tests.fixtures.drawn import drawn

bpy = pytest.importorskip("bpy")

WORK = (
    "open",
    "os.scandir",
    "os.listdir",
    "os.mkdir",
    "os.rename",
    "os.remove",
    "shutil.copyfile",
    "subprocess.Popen",
    "socket.connect",
    "import",
)
_listening: list = []  # the list that notes go to, while there is one


def _note(event: str, arguments: tuple) -> None:
    if _listening and event in WORK:
        _listening[0].append((event, str(arguments[:1])))


sys.addaudithook(_note)  # there is no taking it away again: it sleeps


def panels(addon) -> list:
    found = [kind for kind in bpy.types.Panel.__subclasses__() if kind.__name__.startswith("WILDCAP_PT_")]
    assert len(found) >= 12, addon
    return found


def draw_all(addon) -> tuple[int, list]:
    """How many panels were drawn, and the work that their drawing did."""
    done: list = []
    count = 0
    for kind in panels(addon):
        _listening.append(done)
        try:
            if not hasattr(kind, "poll") or kind.poll(bpy.context):
                drawn(kind)
                count += 1
        finally:
            _listening.clear()
    return count, done


def test_work_is_noted():
    done: list = []
    _listening.append(done)
    try:
        with open(__file__, encoding="utf-8"):
            pass
    finally:
        _listening.clear()
    assert done and done[0][0] == "open"


@pytest.mark.parametrize("state", ["nothing", "a capture", "its head, looked at", "painting"])
def test_no_panel_works_while_it_is_drawn(addon, tmp_path, state):
    addon("paint.session").forget()
    if state != "nothing":
        root = standin.make(tmp_path / "head.wildcap")
        standin.add_evidence(root)
        bpy.ops.wildcap.open_capture(directory=str(root))
    if state in ("its head, looked at", "painting"):
        bpy.ops.wildcap.bring_in_head()
        bpy.ops.wildcap.assemble_material()
        bpy.ops.wildcap.compare_delit()
        addon("capture.strip").look(str(root))
    if state == "painting":
        bpy.ops.wildcap.paint_mask()
    addon("status").refresh(bpy.context)
    draw_all(addon)  # the first drawing imports what Python imports late
    count, done = draw_all(addon)
    if state == "painting":
        bpy.ops.wildcap.finish_mask()
    assert not done
    assert count >= (2 if state == "nothing" else 8)


def test_a_sidebar_is_narrow_below_a_width_in_the_users_own_units(addon):
    base = addon("base_panel")
    widths = [
        type("Drawn", (), {"region": region and type("Region", (), {"width": region})}) for region in (201, 291, None)
    ]
    assert [base.narrow(context) for context in widths] == [True, False, False]


def test_search_finds_every_operator(addon):
    """Blender lists what is registered and not internal."""
    assert addon
    for name in dir(bpy.ops.wildcap):
        assert 'INTERNAL' not in getattr(bpy.types, f"WILDCAP_OT_{name}").bl_options, name
