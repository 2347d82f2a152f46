# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a head is made with, chosen in Blender: its mesh, its delighter and where the chain begins."""

import math
from pathlib import Path

import pytest

from core.capture.capture import Capture
from tests.fixtures import standin
from tests.fixtures.drawn import drawn
from tests.fixtures.refused import refuses

bpy = pytest.importorskip("bpy")


def obj_rows(path, kind: str) -> list[list[float]]:
    lines = path.read_text(encoding="utf-8").splitlines()
    return [[float(x) for x in line.split()[1:]] for line in lines if line.startswith(f"{kind} ")]


def test_the_active_mesh_is_kept_as_it_is_with_its_uvs_and_without_modifiers(addon, capture, item, head):
    refuses("own head or scan", bpy.ops.wildcap.use_active_mesh)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8, location=(0, 0, 1))
    mine = bpy.context.view_layer.objects.active
    mine.name = "Mein Kopf é"
    mine.modifiers.new("Smooth", 'SUBSURF')
    expected = [tuple(mine.matrix_world @ vertex.co) for vertex in mine.data.vertices]
    bpy.context.scene.wildcap.active_index = 0  # makes the head active
    bpy.context.view_layer.objects.active = mine
    bpy.ops.wildcap.use_active_mesh()
    path = Path(item.registration.template)
    assert path.parent == capture / "template" and path.suffix == ".obj"
    rows = [tuple(row[:3]) for row in obj_rows(path, "v")]
    assert len(rows) == len(expected) and len(obj_rows(path, "vt")) > 0
    assert all(row == pytest.approx(place, abs=1e-5) for row, place in zip(rows, expected, strict=True))
    assert head.select_get() and mine.select_get() and bpy.context.view_layer.objects.active == mine
    assert addon("properties").job_settings(item)["registration"]["template"] == str(path)
    bpy.ops.wildcap.use_built_in_head()
    assert item.registration.template == "" and not bpy.ops.wildcap.use_built_in_head.poll()


def test_a_template_is_an_obj_or_a_folder_with_a_neutral_one(item, tmp_path):
    folder, notes = tmp_path / "FaceKit", tmp_path / "notes.txt"
    folder.mkdir()
    notes.touch()
    choose = bpy.ops.wildcap.choose_template
    refuses("no OBJ with 'neutral'", choose, filepath=str(folder))
    (folder / "generic_neutral_mesh.obj").write_text(standin.egg(), encoding="ascii")
    for path in (folder, folder / "generic_neutral_mesh.obj"):
        choose(filepath=str(path))
        assert item.registration.template == str(path)
    for path in (notes, tmp_path / "nothing.obj"):
        refuses("neither an OBJ nor a folder", choose, filepath=str(path))


def test_the_wipe_shows_a_frame_before_and_after_and_leaves_no_image_behind(addon, capture, item):
    delighters, manager = addon("reconstruct.delighters"), bpy.context.window_manager
    for name, before, after in (("00003", (200, 100, 50), (100, 50, 25)), ("00009", (20, 20, 20), (40, 40, 40))):
        for folder, colour in (("frames", before), ("delit", after)):
            (capture / folder).mkdir(exist_ok=True)
            (capture / folder / f"{name}.png").write_bytes(standin.png([[colour] * 40] * 80))

    def at(x: float) -> list[int]:
        pixels, side = list(delighters._icons["wipe"].image_pixels_float), delighters.SIDE_PX
        start = 4 * (side // 2 * side + math.floor(x * side))
        return [round(255 * value) for value in pixels[start : start + 4]]

    manager.wildcap_wipe = 0.5
    images, folder = len(bpy.data.images), addon("captures").folder(item)
    bpy.ops.wildcap.compare_delit(which=0)
    assert delighters.shown_frame(folder) == "00003" and len(bpy.data.images) == images
    assert at(0.3) == [200, 100, 50, 255] and at(0.7) == [100, 50, 25, 255]
    assert at(0.5)[:3] == [255, 255, 255] and at(0.1)[3] == 0
    manager.wildcap_wipe = 0.8
    assert at(0.7) == [200, 100, 50, 255]
    manager.wildcap_wipe = 0.0
    assert at(0.3) == [100, 50, 25, 255]
    bpy.ops.wildcap.compare_delit()
    assert delighters.shown_frame(folder) == "00009" and at(0.5) == [40, 40, 40, 255]
    bpy.ops.wildcap.compare_delit()
    assert delighters.shown_frame(folder) == "00003", "round and round"
    delighters.forget()


def test_sixteen_bits_are_read_as_the_eye_sees_them(addon, tmp_path):
    """What the worker writes has 16 bits, which Blender would take for linear light."""
    image = bpy.data.images.new("deep", 8, 8, float_buffer=True, is_data=True)
    image.pixels.foreach_set([0.25, 0.5, 0.75, 1.0] * 64)
    settings = bpy.context.scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = 'PNG', '16', 'RGB'
    bpy.context.scene.view_settings.view_transform = 'Raw'
    image.save_render(str(tmp_path / "deep.png"))
    bpy.data.images.remove(image)
    pixels = addon("reconstruct.delighters")._read(tmp_path / "deep.png")
    assert pixels[128, 128, :3] == pytest.approx((0.25, 0.5, 0.75), abs=0.01)


def test_the_chain_can_begin_at_any_stage(addon, capture, item, monkeypatch):
    started = []
    monkeypatch.setattr(addon("jobs"), "start", lambda item, goal, *, first, last: started.append((goal, first, last)))
    reconstruct = bpy.ops.wildcap.reconstruct
    for span in ({"first": "upscale"}, {"first": "transfer"}, {"to_end": True}):
        reconstruct(**span)
    refuses("no video", reconstruct, first="delight")
    refuses("no stage named", reconstruct, first="dreams")
    Capture(capture).set_source(capture.parent / "face.mp4")
    for span in ({"first": "delight"}, {}):
        reconstruct(**span)
    assert started == [
        ("solve", "upscale", None),
        ("solve", "transfer", None),
        ("solve", None, None),
        ("reconstruct", "delight", "shadow_mask"),
        ("reconstruct", None, "shadow_mask"),
    ]


def test_colours_are_chosen_by_their_pictures(addon, capture, item, tmp_path, monkeypatch):
    started, panel = [], addon("reconstruct.panel").WILDCAP_PT_colour
    monkeypatch.setattr(addon("jobs"), "start_tool", lambda item, tool, **options: started.append(tool))
    (tmp_path / "film.mov").touch()
    Capture(capture).set_source(tmp_path / "film.mov")
    bpy.ops.wildcap.preview_colours()
    assert started == ["colours"]
    assert "As Recorded" not in [text for text, _ in drawn(panel)]
    folder = capture / "preview"
    folder.mkdir(exist_ok=True)
    for choice in ("recorded", "s_log3"):
        (folder / f"colour_{choice}.png").write_bytes(standin.plain((200, 100, 50)))
    assert list(addon("reconstruct.colours").previews(Capture(capture))) == ["recorded", "s_log3"]
    item.frames.colour = "s_log3"
    assert addon("properties").job_settings(item)["frames"]["colour"] == "s_log3"
