# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A painting session from its outside: what an artist had comes back exactly, and no mask is lost to files, other
programs or a closed Blender."""

import os

import numpy as np
import pytest

from tests.fixtures import standin

bpy = pytest.importorskip("bpy")


def state(thing, without=()) -> dict:
    """Every plain property of a piece of Blender, arrays as tuples, data-blocks by name."""
    found = {}
    for prop in thing.bl_rna.properties:
        if prop.identifier in ("rna_type", *without) or prop.type == 'COLLECTION':
            continue
        value = getattr(thing, prop.identifier)
        if prop.type == 'POINTER':
            found[prop.identifier] = getattr(value, "name", None)
        else:
            found[prop.identifier] = (
                tuple(value) if getattr(prop, "is_array", False) and not isinstance(value, str) else value
            )
    return found


def everything() -> dict:
    """What the artist would miss. Brushes of Blender's own library come and go by themselves."""
    context, paint = bpy.context, bpy.context.scene.tool_settings.image_paint
    spaces = [area.spaces.active for area in context.screen.areas if area.type == 'VIEW_3D']
    assert spaces
    unified = getattr(context.scene.tool_settings, "unified_paint_settings", None) or paint.unified_paint_settings
    active = context.view_layer.objects.active
    return {
        "mode": context.mode,
        "active": active.name if active else None,
        "selected": [o.name for o in context.view_layer.objects if o.select_get()],
        "hidden": [o.name for o in context.view_layer.objects if o.hide_get()],
        "objects": sorted(o.name for o in bpy.data.objects),
        "brushes": sorted(b.name for b in bpy.data.brushes if b.library is None),
        "paint": state(paint, ("tool_slots",)),
        "unified": state(unified),
        "brush": state(paint.brush) if paint.brush else None,
        "shading": [state(s.shading) for s in spaces],
        "overlay": [state(s.overlay) for s in spaces],
        "canvas": state(paint.canvas, ("is_dirty", "bindcode")) if paint.canvas else None,
    }


@pytest.mark.parametrize(
    ("mode", "shading"),
    [
        ('OBJECT', 'SOLID'),
        ('EDIT', 'SOLID'),
        ('SCULPT', 'SOLID'),
        ('WEIGHT_PAINT', 'SOLID'),
        ('TEXTURE_PAINT', 'SOLID'),
        ('OBJECT', 'MATERIAL'),
        ('OBJECT', 'RENDERED'),
        ('OBJECT', 'WIREFRAME'),
    ],
)
def test_leaving_gives_back_what_the_artist_had(addon, capture, mode, shading):
    bpy.ops.wildcap.bring_in_head()
    for entered in ('TEXTURE_PAINT', 'OBJECT'):  # Blender gives the mode its first brush
        bpy.ops.object.mode_set(mode=entered)
    bpy.ops.mesh.primitive_cube_add(location=(1, 0, 0))
    bpy.context.object.name = "Mine"
    paint = bpy.context.scene.tool_settings.image_paint
    paint.mode, paint.canvas = 'IMAGE', bpy.data.images.new("My Canvas", 8, 8)
    paint.stencil_image = bpy.data.images.new("My Stencil", 8, 8)
    paint.use_stencil_layer, paint.stencil_color = False, (0.25, 0.5, 0.75)
    paint.invert_stencil = True
    if paint.brush is not None:
        paint.brush.color, paint.brush.size, paint.brush.strength = (0.125, 0.25, 0.5), 77, 0.5
    for area in bpy.context.screen.areas:
        if area.type == 'VIEW_3D':
            space = area.spaces.active
            space.shading.light, space.shading.color_type = 'MATCAP', 'RANDOM'
            space.shading.type, space.overlay.show_overlays, space.overlay.texture_paint_mode_opacity = (
                shading,
                False,
                0.125,
            )
    bpy.ops.object.mode_set(mode=mode)
    before = everything()
    for on, mask in (('HEAD', 'SHADOW'), ('SHEET', 'SHADOW'), ('SHEET', 'PROTECT'), ('HEAD', 'PROTECT')):
        bpy.ops.wildcap.paint_mask(on=on, mask=mask)
        assert bpy.context.mode == 'PAINT_TEXTURE' and paint.stencil_image.name.endswith("Mask")
    bpy.ops.wildcap.finish_mask()
    after = everything()
    assert {name: (before[name], after[name]) for name in before if before[name] != after[name]} == {}


def test_what_an_undo_brings_back_is_followed_and_nothing_of_the_painting_is_left_in_the_scene(addon, capture):
    files, session = addon("paint.files"), addon("paint.session")
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.wildcap.bring_in_head()
    head, visible = bpy.context.object.name, {o.name for o in bpy.context.view_layer.objects if o.visible_get()}
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.wildcap.paint_mask()
    bpy.ops.ed.undo_push(message="head")
    bpy.ops.wildcap.paint_mask(on='SHEET')
    bpy.ops.ed.undo_push(message="sheet")
    assert session.on_sheet() and not bpy.data.objects[head].visible_get()
    bpy.ops.wildcap.paint_mask(on='HEAD')
    bpy.ops.ed.undo_push(message="head again")
    bpy.ops.ed.undo()
    files.settle()
    assert session.on_sheet() and bpy.context.mode == 'PAINT_TEXTURE'
    bpy.ops.wildcap.finish_mask()
    assert "WildCap Mask Sheet" not in bpy.data.objects
    assert {o.name for o in bpy.context.view_layer.objects if o.visible_get()} == visible
    bpy.ops.ed.undo_push(message="left")
    bpy.ops.ed.undo()  # into the painting that has ended
    files.settle()
    assert bpy.context.mode == 'OBJECT' and not session.active() and "WildCap Mask Sheet" not in bpy.data.objects
    assert {o.name for o in bpy.context.view_layer.objects if o.visible_get()} == visible
    assert not bpy.context.scene.tool_settings.image_paint.use_stencil_layer


def test_a_painting_whose_head_was_undone_or_deleted_still_ends_and_keeps_its_mask(addon, capture):
    session, values = addon("paint.session"), addon("paint.mask_image")
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.paint_mask()
    painted = np.zeros_like(values.mask_values(session.mask()))
    painted[10:20, 30:40] = 1
    values.set_values(session.mask(), painted)
    bpy.ops.object.mode_set(mode='OBJECT')
    bpy.data.objects.remove(bpy.context.object)
    bpy.ops.wildcap.finish_mask()
    assert not session.active() and (capture / "shadow_mask.png").read_bytes() == values.grey_png(painted)
    assert "WildCap Mask" not in bpy.data.brushes and not bpy.context.scene.tool_settings.image_paint.use_stencil_layer


def test_a_brush_that_blenders_mask_tool_links_goes_and_others_of_a_library_stay(addon, capture, tmp_path):
    """A window links its library's Mask when it turns to our brush; without one, the test does so."""
    library = tmp_path / "brushes.blend"
    made = {name: bpy.data.brushes.new(name, mode='TEXTURE_PAINT') for name in ("Mask", "Fill")}
    for name, brush in made.items():
        setattr(brush, "image_brush_type" if hasattr(brush, "image_brush_type") else "image_tool", name.upper())
    bpy.data.libraries.write(str(library), set(made.values()))
    for brush in made.values():
        bpy.data.brushes.remove(brush)
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.paint_mask()
    with bpy.data.libraries.load(str(library), link=True) as (there, wanted):
        wanted.brushes = there.brushes
    bpy.ops.wildcap.finish_mask()
    assert [
        b.name
        for b in bpy.data.brushes
        if b.library is not None and bpy.path.abspath(b.library.filepath) == str(library)
    ] == ["Fill"]


def test_mirrored_strokes_go_with_the_artist_to_the_sheet_and_back_and_stay_with_the_painting(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    head = bpy.context.object
    bpy.ops.wildcap.paint_mask()
    assert bpy.context.object == head and not head.data.use_mirror_x
    head.data.use_mirror_x = True  # the panel's tick: a stroke follows the symmetry of its mesh
    bpy.ops.wildcap.paint_mask(on='SHEET')
    assert bpy.context.object != head and bpy.context.object.data.use_mirror_x
    bpy.context.object.data.use_mirror_x = False
    bpy.ops.wildcap.paint_mask(on='HEAD')
    assert bpy.context.object == head and not head.data.use_mirror_x
    head.data.use_mirror_x = True
    bpy.ops.wildcap.finish_mask()
    assert not head.data.use_mirror_x


def test_the_tint_is_the_artists_own_and_stays_so(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.paint_mask()
    paint = bpy.context.scene.tool_settings.image_paint
    paint.stencil_color = (0.0, 0.25, 1.0)
    space = next(area.spaces.active for area in bpy.context.screen.areas if area.type == 'VIEW_3D')
    space.overlay.texture_paint_mode_opacity = 0.75
    bpy.ops.wildcap.finish_mask()
    bpy.ops.wildcap.paint_mask(mask='PROTECT')
    assert paint.stencil_color[1] > paint.stencil_color[2]
    bpy.ops.wildcap.paint_mask(mask='SHADOW')
    assert tuple(paint.stencil_color) == (0.0, 0.25, 1.0) and space.overlay.texture_paint_mode_opacity == 0.75
    bpy.ops.wildcap.finish_mask()


def spot(image, row: int) -> np.ndarray:
    mask = np.zeros((image.size[1], image.size[0]), np.float32)
    mask[row : row + 4, 20:24] = 1
    return mask


def test_a_file_saved_while_painting_goes_on_painting_and_leaves_as_it_began(addon, capture, tmp_path):
    session, mask_image = addon("paint.session"), addon("paint.mask_image")
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.object.mode_set(mode='SCULPT')
    bpy.ops.wildcap.paint_mask(on='SHEET')
    image = session.mask()
    painted = spot(image, 10)
    mask_image.set_values(image, painted)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    assert (capture / "shadow_mask.png").read_bytes() == mask_image.grey_png(painted)
    assert "wildcap_painting" not in bpy.context.scene
    bpy.ops.wm.read_homefile(use_empty=True)
    assert not session.active()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    assert session.active() and session.on_sheet() and bpy.context.mode == 'PAINT_TEXTURE'
    assert np.array_equal(mask_image.mask_values(session.mask()), painted)
    painted = spot(session.mask(), 30)
    mask_image.set_values(session.mask(), painted)
    bpy.ops.wildcap.finish_mask()
    assert (capture / "shadow_mask.png").read_bytes() == mask_image.grey_png(painted)
    assert (
        bpy.context.mode == 'SCULPT'
        and "WildCap Mask Sheet" not in bpy.data.objects
        and "WildCap Mask" not in bpy.data.brushes
    )
    bpy.ops.object.mode_set(mode='OBJECT')


@pytest.mark.parametrize("newer", ["file", "capture"])
def test_the_newer_mask_of_file_and_capture_wins_and_the_other_goes_to_the_history(addon, capture, tmp_path, newer):
    session, mask_image = addon("paint.session"), addon("paint.mask_image")
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.paint_mask()
    mine = spot(session.mask(), 10)
    mask_image.set_values(session.mask(), mine)
    session.save()
    session.mask().reload()
    session.mask().pack()
    blend = tmp_path / "a.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    other = mask_image.grey_png(spot(session.mask(), 40))
    session.forget()
    (capture / "shadow_mask.png").write_bytes(other)
    os.utime(blend, (2e9, 2e9) if newer == "file" else (1e9, 1e9))
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    winner, loser = (mask_image.grey_png(mine), other) if newer == "file" else (other, mask_image.grey_png(mine))
    saved = (capture / "shadow_mask.png").read_bytes()
    assert saved == winner == mask_image.grey_png(mask_image.mask_values(session.mask()))
    assert loser in [p.read_bytes() for p in (capture / "mask_history").iterdir()]
    bpy.ops.wildcap.finish_mask()
    assert (capture / "shadow_mask.png").read_bytes() == winner


def test_a_mask_that_somebody_else_puts_there_meanwhile_goes_to_the_history(addon, capture):
    session, mask_image = addon("paint.session"), addon("paint.mask_image")
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.paint_mask()
    mask_image.set_values(session.mask(), spot(session.mask(), 10))
    session.save()
    theirs = standin.plain((99,))
    (capture / "shadow_mask.png").write_bytes(theirs)
    mask_image.set_values(session.mask(), spot(session.mask(), 20))
    bpy.ops.wildcap.finish_mask()
    assert [p.read_bytes() for p in (capture / "mask_history").iterdir()] == [theirs]
