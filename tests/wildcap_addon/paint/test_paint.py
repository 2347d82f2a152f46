# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Painting the shadow mask, as far as it goes without a window: files, orientation, set-up and leaving. Strokes are
tests/gui/."""

import numpy as np
import pytest

from tests.fixtures import standin

bpy = pytest.importorskip("bpy")


def test_the_mask_painted_on_the_left_cheek_is_saved_on_the_left_cheek(addon, capture):
    mask_image = addon("paint.mask_image")
    core_capture = addon("captures").Capture(capture)
    image = mask_image.load(core_capture)
    u, v = standin.LEFT_CHEEK_UV
    width, height = image.size
    pixels = np.zeros((height, width, 4), np.float32)  # Blender's rows, from the bottom
    pixels[..., 3] = 1
    pixels[round(v * height), round(u * width)] = 1
    image.pixels.foreach_set(pixels.ravel())
    mask_image.save_image(image, core_capture)

    header = (capture / "shadow_mask.png").read_bytes()[24:26]
    assert header == b"\x08\x00", "8 bit grey"
    read = bpy.data.images.load(str(capture / "shadow_mask.png"))
    read.colorspace_settings.name = 'Non-Color'
    again = mask_image.mask_values(read)
    row, column = np.argwhere(again > 0.5)[0]
    assert column > width / 2, "the person's left is right of the middle of the map"
    assert row > height / 2, "the cheek is below the middle"
    assert (row, column) == (height - 1 - round(v * height), round(u * width))
    assert (again > 0.5).sum() == 1


def test_the_last_ten_masks_are_kept(addon, capture):
    mask_image = addon("paint.mask_image")
    core_capture = addon("captures").Capture(capture)
    image = mask_image.load(core_capture)
    for i in range(14):
        pixels = np.full(len(image.pixels), i / 14, np.float32)
        image.pixels.foreach_set(pixels)
        mask_image.save_image(image, core_capture)
    assert len(list((capture / "mask_history").iterdir())) == 10
    mask_image.save_image(image, core_capture)
    assert len(list((capture / "mask_history").iterdir())) == 10, "an unchanged mask is no new one"


@pytest.mark.parametrize("on", ["HEAD", "SHEET"])
def test_painting_sets_everything_up_and_leaving_puts_it_back(addon, capture, on):
    bpy.ops.wildcap.bring_in_head()
    for mode in ('TEXTURE_PAINT', 'OBJECT'):  # Blender gives the mode its first brush
        bpy.ops.object.mode_set(mode=mode)
    paint = bpy.context.scene.tool_settings.image_paint
    before = {
        name: getattr(paint, name)
        for name in ("mode", "canvas", "use_stencil_layer", "stencil_image", "invert_stencil", "brush")
    }
    objects = {o.name for o in bpy.data.objects}
    bpy.ops.wildcap.paint_mask(on=on)
    assert bpy.context.mode == 'PAINT_TEXTURE'
    assert paint.canvas.name.startswith("texture") and paint.stencil_image.name.endswith("Shadow Mask")
    assert paint.use_stencil_layer and tuple(paint.stencil_color) == (1, 0, 0)
    assert getattr(paint.brush, "image_brush_type", None) == 'MASK' or paint.brush.image_tool == 'MASK'
    bpy.ops.wildcap.paint_mask(on='HEAD' if on == 'SHEET' else 'SHEET')
    assert bpy.context.mode == 'PAINT_TEXTURE'
    bpy.ops.wildcap.finish_mask()
    assert bpy.context.mode == 'OBJECT'
    assert {name: getattr(paint, name) for name in before} == before
    assert {o.name for o in bpy.data.objects} == objects
    assert not any(o.hide_get() for o in bpy.context.view_layer.objects)
    assert (capture / "shadow_mask.png").is_file()
    assert "WildCap Mask" not in bpy.data.brushes


def test_strokes_reach_the_capture_while_the_artist_paints_on(addon, capture, monkeypatch):
    session, mask_image = addon("paint.session"), addon("paint.mask_image")
    bpy.ops.wildcap.bring_in_head()
    (capture / "shadow_mask.png").write_bytes(standin.plain((77,)))
    bpy.ops.wildcap.paint_mask()
    image = bpy.context.scene.tool_settings.image_paint.stencil_image

    def file():
        return (capture / "shadow_mask.png").read_bytes()

    before = file()
    session.keep_up(stroking=False)
    assert file() == before, "nothing was painted"
    for i in range(3):
        image.pixels.foreach_set(np.full(len(image.pixels), 0.2 + 0.1 * i, np.float32))
        session.keep_up(stroking=True)
        assert file() == before
        monkeypatch.setattr(session, "KEEP_UP_S", 0.0)
        session.keep_up(stroking=False)
        session.wait()
        assert file() == mask_image.grey_png(mask_image.mask_values(image)) != before
        before = file()
    steps = [p.read_bytes() for p in (capture / "mask_history").iterdir()]
    assert steps == [standin.plain((77,))], "one session is one step of the history"
    bpy.ops.wildcap.finish_mask()
    assert file() == before


def test_the_buttons_change_the_mask_as_they_say(addon, capture):
    edits = addon("paint.edits")
    spot = np.zeros((256, 256), np.float32)
    spot[100:130, 40:80] = 1
    grown = edits.grow(spot)
    assert grown[99, 60] == 1 and grown[98, 60] == 0 and grown.sum() > spot.sum()
    large = np.kron(spot, np.ones((4, 4), np.float32))
    assert np.array_equal(edits.shrink(edits.grow(large)), large), "a rectangle is whole again"
    assert edits.grow(large)[100 * 4 - 4, 60 * 4] == 1 and edits.grow(large)[100 * 4 - 5, 60 * 4] == 0
    soft = edits.soften(large)
    assert 0.3 < soft[100 * 4, 60 * 4] < 0.7 and soft[110 * 4, 60 * 4] == 1 and soft[0, 0] == 0
    assert np.array_equal(edits.mirror(spot)[:, ::-1], edits.mirror(spot)) and edits.mirror(spot)[110, 255 - 60] == 1

    bpy.ops.wildcap.bring_in_head()
    assert not bpy.ops.wildcap.edit_mask.poll()
    bpy.ops.wildcap.paint_mask()
    image = bpy.context.scene.tool_settings.image_paint.stencil_image
    mask_image = addon("paint.mask_image")
    first = np.zeros((image.size[1], image.size[0]), np.float32)
    first[5:9, 40:50] = 1
    mask_image.set_values(image, first)
    assert np.array_equal(mask_image.mask_values(image), first)
    bpy.ops.wildcap.edit_mask(kind='INVERT')
    assert np.array_equal(mask_image.mask_values(image), 1 - first)
    bpy.ops.wildcap.edit_mask(kind='PROPOSAL')
    assert mask_image.mask_values(image).max() == 0
    bpy.ops.wildcap.finish_mask()
    assert (capture / "shadow_mask.png").read_bytes() == mask_image.grey_png(np.zeros_like(first))


def test_what_is_protected_is_a_mask_of_its_own(addon, capture):
    session, mask_image = addon("paint.session"), addon("paint.mask_image")
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.paint_mask(mask='PROTECT')
    bpy.ops.wildcap.finish_mask()
    assert not (capture / "protect_mask.png").exists(), "nothing was painted, so nothing is to be solved again"
    bpy.ops.wildcap.paint_mask(mask='PROTECT')
    paint = bpy.context.scene.tool_settings.image_paint
    assert paint.stencil_image.name.endswith("Protect Mask") and paint.stencil_color[1] > paint.stencil_color[0]
    spot = np.zeros((paint.stencil_image.size[1], paint.stencil_image.size[0]), np.float32)
    spot[10:14, 20:24] = 1
    mask_image.set_values(paint.stencil_image, spot)
    bpy.ops.wildcap.paint_mask(mask='SHADOW', on='SHEET')
    saved = (capture / "protect_mask.png").read_bytes()
    assert saved == mask_image.grey_png(spot), "turning to the other mask saves this one"
    assert (
        session.painted_kind() == 'SHADOW' and session.on_sheet() and paint.stencil_image.name.endswith("Shadow Mask")
    )
    bpy.ops.wildcap.finish_mask()
    bpy.ops.wildcap.paint_mask(mask='PROTECT')
    assert np.array_equal(mask_image.mask_values(paint.stencil_image), spot)
    with pytest.raises(RuntimeError, match="no proposal for the protect mask"):
        bpy.ops.wildcap.edit_mask(kind='PROPOSAL')
    bpy.ops.wildcap.finish_mask()
    assert (capture / "protect_mask.png").read_bytes() == mask_image.grey_png(spot)


def test_a_mask_is_not_lost_when_another_file_is_opened(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.paint_mask()
    bpy.ops.wm.read_homefile(use_empty=True)
    assert (capture / "shadow_mask.png").is_file()
    assert not addon("paint.session").active()
