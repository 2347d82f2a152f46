# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What F3 finds: every operator in every mode, with and without a capture, works or says in plain words why not; never
a traceback."""

import shutil
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

ASKS = {
    "choose_video": {"filepath": "/none.mp4"},
    "open_capture": {"directory": "/none"},
    "open_batch": {"directory": "/none"},
    "use_python": {"filepath": "/none"},
}


@pytest.fixture
def operators(addon, monkeypatch, tmp_path):
    """All of the add-on's operators; whatever would start a process, a browser or a long render is kept from it."""
    for name in ("start", "start_tool"):
        monkeypatch.setattr(addon("jobs"), name, lambda *_, **__: SimpleNamespace())
    for name in ("render_still", "render_stills", "render_frames"):
        monkeypatch.setattr(addon("relight.output"), name, lambda *_: None)
    addon("preferences").get().captures = str(tmp_path / "captures")
    return sorted(name for name in dir(bpy.ops.wildcap) if not name.startswith("_"))


def call(name: str, capfd) -> str:
    """'' where it worked, else what it said."""
    try:
        assert getattr(bpy.ops.wildcap, name)(**ASKS.get(name, {})) == {'FINISHED'}
        said = ""
    except RuntimeError as refusal:
        said = str(refusal).strip()
    printed = "".join(capfd.readouterr())
    assert "Traceback" not in printed + said and "An error inside WildCap" not in said, f"{name}: {said} {printed}"
    assert "context is incorrect" not in said, f"{name} does not say why it is greyed out"
    return said


def begun(said: str) -> bool:
    """Whether Blender began the operator that said so. Where its poll refused it nothing can have changed, and the next
    one needs no new scene: most of a test's time."""
    return ".poll()" not in said


def enter(mode: str) -> None:
    """Another mode on a mesh of the artist's own."""
    if bpy.context.mode != 'OBJECT':
        bpy.ops.object.mode_set(mode='OBJECT')
    if mode != 'OBJECT':
        bpy.ops.mesh.primitive_cube_add()
        bpy.ops.object.mode_set(mode=mode)


MODES = ('OBJECT', 'EDIT', 'SCULPT', 'WEIGHT_PAINT', 'TEXTURE_PAINT')


@pytest.mark.parametrize("mode", MODES)
def test_in_an_empty_scene_each_operator_works_or_says_why_not(operators, capfd, mode):
    assert len(operators) >= 18
    refused, changed = {}, True
    for name in operators:
        if changed:
            bpy.ops.wm.read_homefile(use_empty=True)
            enter(mode)
        capfd.readouterr()
        refused[name] = call(name, capfd)
        changed = begun(refused[name])
    assert refused["open_sample_head"] == "", refused
    assert all(refused[name] for name in ("solve", "reconstruct", "paint_mask", "render", "close_capture", "cancel"))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("state", ["without its head in the scene", "painting", "its folder gone"])
def test_with_a_capture_each_operator_works_or_says_why_not(operators, capture, capfd, state, mode):
    changed = True
    for name in operators:
        if changed:
            set_up(capture, state, mode)
        capfd.readouterr()
        changed = begun(call(name, capfd))
        if state == "painting" and name == "finish_mask":
            assert bpy.context.mode == 'OBJECT'


def set_up(capture, state: str, mode: str) -> None:
    """A new scene with the capture in that state, in that mode."""
    bpy.ops.wm.read_homefile(use_empty=True)
    if not capture.exists():
        shutil.move(capture.with_suffix(".away"), capture)
    bpy.ops.wildcap.open_capture(directory=str(capture))
    if state == "painting":
        bpy.ops.wildcap.bring_in_head()
        bpy.ops.wildcap.paint_mask(on='SHEET')
    enter(mode)
    if state == "its folder gone":
        shutil.move(capture, capture.with_suffix(".away"))


def test_every_operator_has_a_tooltip_and_a_label(operators):
    for name in operators:
        kind = getattr(bpy.types, f"WILDCAP_OT_{name}")
        tooltip = getattr(bpy.ops.wildcap, name).get_rna_type().description
        assert kind.bl_rna.name and len(tooltip) > 15 and not tooltip.endswith("."), name
        assert "\n" not in tooltip and "  " not in tooltip, name
