# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Painting the masks, as far as it goes without a window: files, orientation, what the buttons do. Strokes are
tests/gui/."""

import numpy as np
import pytest

from tests.fixtures import standin
from tests.fixtures.refused import refuses

bpy = pytest.importorskip("bpy")


def fill(image, value: float) -> None:
    image.pixels.foreach_set(np.full(len(image.pixels), value, np.float32))


def test_the_mask_painted_on_the_left_cheek_is_saved_on_the_left_cheek(mask_image, capture, item, addon):
    folder = addon("captures").folder(item)
    image = mask_image.load(folder)
    (u, v), (width, height) = standin.LEFT_CHEEK_UV, image.size
    pixels = np.zeros((height, width, 4), np.float32)  # Blender's rows, from the bottom
    pixels[..., 3] = 1
    pixels[round(v * height), round(u * width)] = 1
    image.pixels.foreach_set(pixels.ravel())
    mask_image.store_mask(mask_image.mask_values(image), folder, 'SHADOW')
    assert (capture / "shadow_mask.png").read_bytes()[24:26] == b"\x08\x00", "8 bit grey"
    saved = bpy.data.images.load(str(capture / "shadow_mask.png"))
    saved.colorspace_settings.name = 'Non-Color'
    ((row, column),) = np.argwhere(mask_image.mask_values(saved) > 0.5)
    assert column > width / 2, "the person's left is right of the middle of the map"
    assert row > height / 2, "the cheek is below the middle"
    assert (row, column) == (height - 1 - round(v * height), round(u * width))


def test_strokes_reach_the_capture_while_the_artist_paints_on(session, mask_image, capture, head, monkeypatch):
    path, first = capture / "shadow_mask.png", standin.plain((77,))
    path.write_bytes(first)
    bpy.ops.wildcap.paint_mask()
    image, before = session.mask(), first
    session.keep_up(stroking=False)
    assert path.read_bytes() == before, "nothing was painted"
    for value in (0.2, 0.3, 0.4):
        fill(image, value)
        session.keep_up(stroking=True)
        assert path.read_bytes() == before
        monkeypatch.setattr(session, "KEEP_UP_S", 0.0)
        session.keep_up(stroking=False)
        session.wait()
        assert path.read_bytes() == mask_image.grey_png(mask_image.mask_values(image)) != before
        before = path.read_bytes()
    history = [step.read_bytes() for step in (capture / "mask_history").iterdir()]
    assert history == [first], "one session is one step of the history"
    bpy.ops.wildcap.finish_mask()
    assert path.read_bytes() == before


def test_a_mask_grows_shrinks_softens_and_is_mirrored(addon):
    edits = addon("paint.edits")
    spot = np.zeros((256, 256), np.float32)
    spot[100:130, 40:80] = 1
    grown = edits.grow(spot)
    assert grown[99, 60] == 1 and grown[98, 60] == 0 and grown.sum() > spot.sum()
    mirrored = edits.mirror(spot)
    assert np.array_equal(mirrored[:, ::-1], mirrored) and mirrored[110, 255 - 60] == 1
    large = np.kron(spot, np.ones((4, 4), np.float32))
    grown, soft = edits.grow(large), edits.soften(large)
    assert np.array_equal(edits.shrink(grown), large), "a rectangle is whole again"
    assert grown[100 * 4 - 4, 60 * 4] == 1 and grown[100 * 4 - 5, 60 * 4] == 0
    assert 0.3 < soft[100 * 4, 60 * 4] < 0.7 and soft[110 * 4, 60 * 4] == 1 and soft[0, 0] == 0


def test_the_buttons_change_the_mask_that_is_painted(session, mask_image, capture, head, paint_spot):
    edit = bpy.ops.wildcap.edit_mask
    assert not edit.poll()
    bpy.ops.wildcap.paint_mask()
    paint_spot(5)
    first = mask_image.mask_values(session.mask())
    edit(kind='INVERT')
    assert np.array_equal(mask_image.mask_values(session.mask()), 1 - first)
    edit(kind='PROPOSAL')
    assert mask_image.mask_values(session.mask()).max() == 0
    bpy.ops.wildcap.finish_mask()
    assert (capture / "shadow_mask.png").read_bytes() == mask_image.grey_png(np.zeros_like(first))


def test_what_is_protected_is_a_mask_of_its_own(session, mask_image, capture, head, paint_spot):
    click, path = bpy.ops.wildcap, capture / "protect_mask.png"
    paint = bpy.context.scene.tool_settings.image_paint
    click.paint_mask(mask='PROTECT')
    click.finish_mask()
    assert not path.exists(), "nothing was painted, so nothing is to be solved again"
    click.paint_mask(mask='PROTECT')
    assert paint.stencil_image.name.endswith("Protect Mask") and paint.stencil_color[1] > paint.stencil_color[0]
    painted = paint_spot(10)
    click.paint_mask(mask='SHADOW', on='SHEET')
    assert path.read_bytes() == painted, "turning to the other mask saves this one"
    assert session.painted_kind() == 'SHADOW' and session.on_sheet()
    assert paint.stencil_image.name.endswith("Shadow Mask")
    click.finish_mask()
    click.paint_mask(mask='PROTECT')
    assert mask_image.grey_png(mask_image.mask_values(paint.stencil_image)) == painted
    refuses("no proposal for the protect mask", click.edit_mask, kind='PROPOSAL')
    click.finish_mask()
    assert path.read_bytes() == painted


def test_a_mask_is_not_lost_when_another_file_is_opened(session, capture, head):
    bpy.ops.wildcap.paint_mask()
    bpy.ops.wm.read_homefile(use_empty=True)
    assert (capture / "shadow_mask.png").is_file() and not session.active()
