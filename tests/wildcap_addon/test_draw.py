# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels are drawn many times a second: no `draw` or `poll` of one reads a file or a folder, starts a process or asks
the network."""

import sys
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

from tests.fixtures import standin
from tests.fixtures.drawn import draw

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


@contextmanager
def noted():
    _listening.append(work := [])
    try:
        yield work
    finally:
        _listening.clear()


def draw_all() -> tuple[list[str], list]:
    """The labels of all buttons, and the work that the drawing did."""
    kinds = [kind for kind in bpy.types.Panel.__subclasses__() if kind.__name__.startswith("WILDCAP_PT_")]
    assert len(kinds) >= 12
    with noted() as work:
        layouts = [draw(kind) for kind in kinds if not hasattr(kind, "poll") or kind.poll(bpy.context)]
    calls = [call for layout in layouts for call in layout.calls]
    return [options.get("text", "") for name, _, options in calls if name == "operator"], work


@pytest.mark.parametrize(
    ("state", "button"),
    [
        ("nothing", "Install Solver"),
        ("a capture", "Bring In Head"),
        ("its head", "Assemble Material"),
        ("its material", "Render"),
        ("painting", "Save Mask and Leave"),
        ("painting a layer", "Save Layer and Leave"),
    ],
)
def test_every_panel_draws_in_every_state_and_none_works_meanwhile(addon, tmp_path, state, button):
    addon("paint.session").forget()
    if state != "nothing":
        root = standin.make(tmp_path / "head.wildcap")
        standin.add_evidence(root)
        bpy.ops.wildcap.open_capture(directory=str(root))
        addon("capture.strip").look(str(root))
    if state not in ("nothing", "a capture"):
        bpy.ops.wildcap.bring_in_head()
        bpy.ops.wildcap.compare_delit()
    if state == "its material":
        bpy.ops.wildcap.assemble_material()
    if state == "painting":
        bpy.ops.wildcap.paint_mask()
    if state == "painting a layer":
        bpy.context.scene.wildcap.layer_side = "1024"
        bpy.ops.wildcap.layer_add(map='albedo')
    addon("status").refresh(bpy.context)
    draw_all()  # the first drawing imports what Python imports late
    labels, work = draw_all()
    if state.startswith("painting"):
        bpy.ops.wildcap.finish_mask()
    assert button in labels and not work
    with noted() as work, open(__file__, encoding="utf-8"):
        pass
    assert work, "nothing would have been noted"


def test_a_sidebar_is_narrow_below_a_width_in_the_users_own_units(addon):
    regions = [SimpleNamespace(width=201), SimpleNamespace(width=291), None]
    assert [addon("base_panel").narrow(SimpleNamespace(region=region)) for region in regions] == [True, False, False]
