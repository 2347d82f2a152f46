# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of the artist: what is painted on the map becomes a layer, and the rows say what the capture's list says."""

import json

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.fixtures.recorded import make_entry  # noqa: E402

SIDE = 1024
BLUE = (0.02, 0.03, 0.6)


@pytest.fixture
def face(capture, head, addon):
    """The capture with solved maps of one grey, and its item."""
    save = addon("paint.png").encode
    (capture / "maps").mkdir(exist_ok=True)
    for name, value in (("diffuse_albedo", 140), ("specular_albedo", 100), ("normal", 128)):
        pixels = np.full((64, 64, 3), value, np.uint8)
        pixels[:, :32] += 20  # the left half of the map
        (capture / "maps" / f"{name}.png").write_bytes(save(pixels))
    bpy.context.scene.wildcap.layer_side = str(SIDE)
    return bpy.context.scene.wildcap.captures[0]


@pytest.fixture
def layers(addon):
    return addon("layers")


def paint(session, rows: slice, columns: slice, colour=BLUE, cover: float = 1.0) -> None:
    """As a brush does: rows from the top, a linear colour."""
    image = session.mask()
    pixels = np.empty((SIDE, SIDE, 4), np.float32)
    image.pixels.foreach_get(pixels.ravel())
    there = np.flipud(pixels)[rows, columns, :3]
    there += np.float32(cover) * (np.array(colour, np.float32) - there)
    image.pixels.foreach_set(pixels.ravel())
    image.update()


def stored(addon, path) -> np.ndarray:
    """A file's pixels, rows from the top."""
    return np.flipud(addon("data_blocks").load_pixels(path))


def entries(capture) -> list[dict]:
    return json.loads((capture / "retouch" / "layers.json").read_text())["layers"]


def test_a_stroke_becomes_a_layer_of_16_bits_in_its_place_and_nothing_else_does(addon, session, capture, face, layers):
    bpy.ops.wildcap.layer_add(map='albedo')
    assert bpy.context.mode == 'PAINT_TEXTURE'
    paint(session, slice(600, 680), slice(300, 400))
    paint(session, slice(100, 140), slice(700, 740), cover=0.5)
    bpy.ops.wildcap.finish_mask()
    assert bpy.context.mode == 'OBJECT' and not [i for i in bpy.data.images if i.name.startswith("WildCap Retouch")]
    (entry,) = entries(capture)
    layer = stored(addon, capture / "retouch" / entry["file"])
    assert layer.shape == (SIDE, SIDE, 4)
    covered = layer[..., 3] > 0
    assert covered[600:680, 300:400].all() and covered[100:140, 700:740].all()
    covered[600:680, 300:400] = covered[100:140, 700:740] = False
    assert not covered.any()
    encode = addon("colours").linear_to_srgb
    assert np.abs(layer[640, 350] - [*encode(np.array(BLUE)), 1]).max() < 2e-4
    half = encode(0.5 * (np.array(BLUE) + addon("colours").srgb_to_linear(np.full(3, 140 / 255))))
    below = 140 / 255
    assert np.abs(below + layer[120, 720, 3] * (layer[120, 720, :3] - below) - half).max() < 2e-4
    assert (capture / "retouch" / entry["file"].replace(".png", ".below.png")).is_file()
    assert [row.name for row in face.layers] == [entry["name"]] == ["Albedo"]


def test_what_is_erased_and_what_was_only_looked_at_leaves_the_file_alone(addon, session, capture, face):
    bpy.ops.wildcap.layer_add(map='albedo')
    assert not (capture / "retouch" / "Albedo.png").exists(), "nothing was painted"
    paint(session, slice(600, 680), slice(300, 400))
    bpy.ops.wildcap.finish_mask()
    path = capture / "retouch" / "Albedo.png"
    first = path.read_bytes()
    bpy.ops.wildcap.layer_paint()
    bpy.ops.wildcap.finish_mask()
    assert path.read_bytes() == first
    bpy.ops.wildcap.layer_paint()
    source = addon("paint.layer_painting").SOURCE
    bpy.ops.wildcap.layer_brush(kind='BELOW')
    image = bpy.context.scene.tool_settings.image_paint
    assert image.use_clone_layer and image.clone_image.name == source
    pixels = np.array(bpy.data.images[source].pixels[:], np.float32)
    session.mask().pixels.foreach_set(pixels)
    bpy.ops.wildcap.finish_mask()
    assert stored(addon, path)[..., 3].max() == 0
    assert first in [step.read_bytes() for step in (capture / "mask_history").iterdir()]


def test_layers_lie_over_each_other_and_only_the_upper_one_is_painted(addon, session, capture, face):
    bpy.ops.wildcap.layer_add(map='albedo')
    paint(session, slice(600, 680), slice(300, 400))
    bpy.ops.wildcap.finish_mask()
    lower = (capture / "retouch" / "Albedo.png").read_bytes()
    bpy.ops.wildcap.layer_add(map='albedo')
    canvas = np.flipud(np.array(session.mask().pixels[:], np.float32).reshape(SIDE, SIDE, 4))
    assert np.abs(canvas[640, 350, :3] - BLUE).max() < 1e-3, "the lower layer is seen"
    paint(session, slice(640, 660), slice(350, 500), colour=(0.5, 0.1, 0.1))
    bpy.ops.wildcap.finish_mask()
    assert (capture / "retouch" / "Albedo.png").read_bytes() == lower
    covered = stored(addon, capture / "retouch" / "Albedo_001.png")[..., 3] > 0
    assert covered[640:660, 350:500].all() and covered.sum() == 20 * 150
    assert [entry["name"] for entry in entries(capture)] == ["Albedo", "Albedo.001"]
    assert [row.name for row in face.layers] == ["Albedo.001", "Albedo"]


def test_the_other_side_is_copied_with_its_relief_turned(addon, session, face):
    for kind, left in (("albedo", 160), ("normal", 148)):
        bpy.ops.wildcap.layer_add(map=kind)
        bpy.ops.wildcap.layer_brush(kind='MIRROR')
        image = bpy.context.scene.tool_settings.image_paint.clone_image
        pixels = np.flipud(np.array(image.pixels[:], np.float32).reshape(SIDE, SIDE, 4))[..., :3]
        wanted = np.full(3, left / 255)
        if kind == "normal":
            wanted[0] = 1 - wanted[0]
        else:
            wanted = addon("colours").srgb_to_linear(wanted)
        assert np.abs(pixels[500, 900] - wanted).max() < 2e-3, "the right half shows the left one"
        bpy.ops.wildcap.finish_mask()


def test_healing_takes_the_spot_away(addon, session, capture, face):
    bpy.ops.wildcap.layer_add(map='albedo')
    canvas = np.array(session.mask().pixels[:], np.float32)
    with pytest.raises(RuntimeError, match="Nothing was painted"):
        bpy.ops.wildcap.layer_heal()
    paint(session, slice(600, 640), slice(700, 740))
    bpy.ops.wildcap.layer_heal()
    healed = np.array(session.mask().pixels[:], np.float32)
    assert np.abs(healed - canvas).max() < 2e-3, "one grey is healed by the same grey"
    paint(session, slice(300, 340), slice(700, 740))
    bpy.ops.wildcap.layer_brush(kind='DRAW')
    paint(session, slice(600, 640), slice(700, 740))
    bpy.ops.wildcap.layer_heal()
    kept = np.flipud(np.array(session.mask().pixels[:], np.float32).reshape(SIDE, SIDE, 4))[..., :3]
    assert np.abs(kept[320, 720] - BLUE).max() < 1e-4, "a stroke from before the brush was chosen stays"
    assert np.abs(kept[620, 720] - canvas[0:3]).max() < 0.1
    bpy.ops.wildcap.finish_mask()


def test_rows_and_list_say_the_same(capture, face, layers, addon):
    core = addon("paint.layer_operators").retouch_edits
    folder = addon("captures").folder(face)
    for name in ("Mole", "Scar"):
        core.add_layer(folder, name, "albedo")
    assert layers.take_in(face) and not layers.take_in(face)
    assert [row.name for row in face.layers] == ["Scar", "Mole"]
    face.layers[0].opacity, face.layers[0].locked, face.layers[1].visible = 0.9, True, False
    face.layers[1].name = "Scar"
    assert face.layers[1].name == "Scar.001"
    there = {entry["name"]: entry for entry in entries(capture)}
    assert there["Scar"]["opacity"] == 0.9 and there["Scar"]["locked"] and not there["Scar.001"]["visible"]
    before = (capture / "retouch" / "layers.json").stat().st_mtime_ns
    layers._after_undo()
    assert (capture / "retouch" / "layers.json").stat().st_mtime_ns == before, "nothing was undone"
    face.active_layer = 0
    bpy.ops.wildcap.layer_move(up=False)
    assert [row.name for row in face.layers] == ["Scar.001", "Scar"] and layers.active_file(face) == "Scar.png"
    bpy.ops.wildcap.layer_remove('EXEC_DEFAULT')
    assert [entry["name"] for entry in entries(capture)] == ["Scar.001"] == [row.name for row in face.layers]


def test_a_painting_goes_on_in_the_reopened_blend_and_a_killed_one_is_in_the_capture(
    addon, session, capture, face, tmp_path
):
    blend = tmp_path / "a.blend"
    bpy.ops.wildcap.layer_add(map='albedo')
    paint(session, slice(600, 680), slice(300, 400))
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    path = capture / "retouch" / "Albedo.png"
    first = path.read_bytes()
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    assert session.active() and session.layer() is not None
    paint(session, slice(100, 120), slice(300, 400))
    bpy.ops.wildcap.finish_mask()
    layer = stored(addon, path)
    assert layer[640, 350, 3] == 1 and layer[110, 350, 3] == 1 and path.read_bytes() != first


def test_a_layer_follows_the_tone_that_is_shown_unless_it_is_locked(addon, session, capture, face):
    painting = addon("paint.layer_painting")
    figures = {"skin_tone_srgb": [0.6, 0.5, 0.4], "skin_tone_source": "scene"}
    record = {"format": 2, "source": "", "stages": {"solve": make_entry(figures=figures)}}
    (capture / "capture.json").write_text(json.dumps(record))
    bpy.ops.wildcap.layer_add(map='albedo')
    paint(session, slice(600, 680), slice(300, 400), colour=(0.3, 0.2, 0.1))
    bpy.ops.wildcap.finish_mask()
    assert entries(capture)[0]["tone"] == [0.6, 0.5, 0.4]
    gain = np.array([0.5, 0.5, 0.5])
    linear = gain * addon("colours").srgb_to_linear(np.array([0.6, 0.5, 0.4]))
    addon("tones").choose(face, tuple(addon("colours").linear_to_srgb(linear)))
    for locked, wanted in ((False, gain * (0.3, 0.2, 0.1)), (True, np.array((0.3, 0.2, 0.1)))):
        face.layers[0].locked = locked
        bpy.ops.wildcap.layer_paint()
        canvas = np.flipud(np.array(session.mask().pixels[:], np.float32).reshape(SIDE, SIDE, 4))
        assert np.abs(canvas[640, 350, :3] - wanted).max() < 2e-3
        bpy.ops.wildcap.finish_mask()
    assert entries(capture)[0]["tone"] == [0.6, 0.5, 0.4], "it was only looked at"
    assert painting.CANVAS not in bpy.data.images
