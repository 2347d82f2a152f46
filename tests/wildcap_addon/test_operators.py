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
    for module, names in (
        ("jobs", ("start", "start_tool")),
        ("relight.output", ("render_still", "render_stills", "render_frames")),
    ):
        for name in names:
            monkeypatch.setattr(addon(module), name, lambda *_, **__: SimpleNamespace())
    addon("preferences").get().captures = str(tmp_path / "captures")
    return sorted(name for name in dir(bpy.ops.wildcap) if not name.startswith("_"))


def call(name: str, capfd) -> str:
    """What an operator said; '' where it worked."""
    capfd.readouterr()
    try:
        assert getattr(bpy.ops.wildcap, name)(**ASKS.get(name, {})) == {'FINISHED'}
        said = ""
    except RuntimeError as refusal:
        said = str(refusal).strip()
    printed = "".join(capfd.readouterr())
    assert "Traceback" not in printed + said and "An error inside WildCap" not in said, f"{name}: {said} {printed}"
    assert "context is incorrect" not in said, f"{name} does not say why it is greyed out"
    return said


def call_all(operators, capfd, set_up) -> dict[str, str]:
    """What each said in the scene that is set up anew after each that Blender began: where poll refused, nothing can
    have changed."""
    said, is_new = {}, False
    for name in operators:
        if not is_new:
            set_up()
        said[name] = call(name, capfd)
        is_new = ".poll()" in said[name]
    return said


def enter(mode: str) -> None:
    """Another mode on a mesh of the artist's own."""
    if bpy.context.mode != 'OBJECT':
        bpy.ops.object.mode_set(mode='OBJECT')
    if mode != 'OBJECT':
        bpy.ops.mesh.primitive_cube_add()
        bpy.ops.object.mode_set(mode=mode)


def test_in_an_empty_scene_each_operator_works_or_says_why_not(operators, capfd):
    said = call_all(operators, capfd, lambda: bpy.ops.wm.read_homefile(use_empty=True))
    assert said["open_sample_head"] == "", said
    assert all(said[name] for name in ("solve", "reconstruct", "paint_mask", "render", "close_capture", "cancel"))


@pytest.mark.parametrize(
    ("state", "mode"),
    [
        ("without its head in the scene", 'OBJECT'),
        ("without its head in the scene", 'EDIT'),
        ("painting", 'TEXTURE_PAINT'),
        ("its folder gone", 'OBJECT'),
    ],
)
def test_with_a_capture_each_operator_works_or_says_why_not(operators, capture, capfd, state, mode):
    away = capture.with_suffix(".away")

    def set_up():
        bpy.ops.wm.read_homefile(use_empty=True)
        if not capture.exists():
            shutil.move(away, capture)
        bpy.ops.wildcap.open_capture(directory=str(capture))
        if state == "painting":
            bpy.ops.wildcap.bring_in_head()
            bpy.ops.wildcap.paint_mask(on='SHEET')
        enter(mode)
        if state == "its folder gone":
            shutil.move(capture, away)

    said = call_all(operators, capfd, set_up)
    assert state != "painting" or said["finish_mask"] == ""
