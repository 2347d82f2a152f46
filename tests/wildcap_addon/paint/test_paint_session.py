# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A painting session from its outside: what an artist had comes back exactly, and no mask is lost to files, other
programs or a closed Blender."""

import os

import pytest

from tests.fixtures import standin

bpy = pytest.importorskip("bpy")


def state(thing, without=()) -> dict:
    """Every plain property of a piece of Blender, arrays as tuples, data-blocks by name."""
    kinds = {prop.identifier: prop for prop in thing.bl_rna.properties if prop.type != 'COLLECTION'}
    values = {name: getattr(thing, name) for name in kinds if name not in ("rna_type", *without)}
    return {
        name: getattr(value, "name", None)
        if kinds[name].type == 'POINTER'
        else tuple(value)
        if getattr(kinds[name], "is_array", False) and not isinstance(value, str)
        else value
        for name, value in values.items()
    }


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
        ('SCULPT', 'MATERIAL'),
        ('WEIGHT_PAINT', 'RENDERED'),
        ('TEXTURE_PAINT', 'WIREFRAME'),
    ],
)
def test_leaving_gives_back_what_the_artist_had(capture, head, mode, shading):
    for entered in ('TEXTURE_PAINT', 'OBJECT'):  # Blender gives the mode its first brush
        bpy.ops.object.mode_set(mode=entered)
    bpy.ops.mesh.primitive_cube_add(location=(1, 0, 0))
    paint = bpy.context.scene.tool_settings.image_paint
    paint.mode, paint.canvas = 'IMAGE', bpy.data.images.new("My Canvas", 8, 8)
    paint.stencil_image = bpy.data.images.new("My Stencil", 8, 8)
    paint.use_stencil_layer, paint.stencil_color, paint.invert_stencil = False, (0.25, 0.5, 0.75), True
    if paint.brush is not None:
        paint.brush.color, paint.brush.size, paint.brush.strength = (0.125, 0.25, 0.5), 77, 0.5
    for space in (area.spaces.active for area in bpy.context.screen.areas if area.type == 'VIEW_3D'):
        space.shading.light, space.shading.color_type = 'MATCAP', 'RANDOM'
        space.shading.type, space.overlay.show_overlays = shading, False
        space.overlay.texture_paint_mode_opacity = 0.125
    bpy.ops.object.mode_set(mode=mode)
    before = everything()
    for on, mask in (('HEAD', 'SHADOW'), ('SHEET', 'SHADOW'), ('SHEET', 'PROTECT'), ('HEAD', 'PROTECT')):
        bpy.ops.wildcap.paint_mask(on=on, mask=mask)
        assert bpy.context.mode == 'PAINT_TEXTURE' and paint.stencil_image.name.endswith("Mask")
        assert paint.canvas.name.startswith("texture") and paint.use_stencil_layer and not paint.invert_stencil
        assert 'MASK' in (getattr(paint.brush, "image_brush_type", None), getattr(paint.brush, "image_tool", None))
    bpy.ops.wildcap.finish_mask()
    after = everything()
    assert {name: (before[name], after[name]) for name in before if before[name] != after[name]} == {}
    assert (capture / "shadow_mask.png").is_file()


def test_what_an_undo_brings_back_is_followed_and_nothing_of_the_painting_is_left_in_the_scene(addon, session, capture):
    def visible() -> set[str]:
        return {o.name for o in bpy.context.view_layer.objects if o.visible_get()}

    settle, click, push = addon("paint.files").settle, bpy.ops.wildcap, bpy.ops.ed.undo_push
    bpy.ops.mesh.primitive_cube_add()
    click.bring_in_head()
    head, before = bpy.context.object.name, visible()
    push(message="before")
    click.paint_mask()
    push(message="head")
    click.paint_mask(on='SHEET')
    push(message="sheet")
    assert session.on_sheet() and not bpy.data.objects[head].visible_get()
    click.paint_mask(on='HEAD')
    push(message="head again")
    bpy.ops.ed.undo()
    settle()
    assert session.on_sheet() and bpy.context.mode == 'PAINT_TEXTURE'
    click.finish_mask()
    assert "WildCap Mask Sheet" not in bpy.data.objects and visible() == before
    push(message="left")
    bpy.ops.ed.undo()  # into the painting that has ended
    settle()
    assert bpy.context.mode == 'OBJECT' and not session.active() and "WildCap Mask Sheet" not in bpy.data.objects
    assert visible() == before and not bpy.context.scene.tool_settings.image_paint.use_stencil_layer


def test_a_brush_that_blenders_mask_tool_links_goes_and_others_of_a_library_stay(head, tmp_path):
    """A window links its library's Mask when it turns to our brush; without one, the test does so."""
    library = tmp_path / "brushes.blend"
    made = [bpy.data.brushes.new(name, mode='TEXTURE_PAINT') for name in ("Mask", "Fill")]
    for brush in made:
        kind = "image_brush_type" if hasattr(brush, "image_brush_type") else "image_tool"
        setattr(brush, kind, brush.name.upper())
    bpy.data.libraries.write(str(library), set(made))
    for brush in made:
        bpy.data.brushes.remove(brush)
    bpy.ops.wildcap.paint_mask()
    with bpy.data.libraries.load(str(library), link=True) as (there, wanted):
        wanted.brushes = there.brushes
    bpy.ops.wildcap.finish_mask()
    linked = [b for b in bpy.data.brushes if b.library and bpy.path.abspath(b.library.filepath) == str(library)]
    assert [brush.name for brush in linked] == ["Fill"]


def test_mirrored_strokes_go_with_the_artist_to_the_sheet_and_back_and_stay_with_the_painting(head):
    click = bpy.ops.wildcap
    click.paint_mask()
    assert bpy.context.object == head and not head.data.use_mirror_x
    head.data.use_mirror_x = True  # the panel's tick: a stroke follows the symmetry of its mesh
    click.paint_mask(on='SHEET')
    assert bpy.context.object != head and bpy.context.object.data.use_mirror_x
    bpy.context.object.data.use_mirror_x = False
    click.paint_mask(on='HEAD')
    assert bpy.context.object == head and not head.data.use_mirror_x
    head.data.use_mirror_x = True
    click.finish_mask()
    assert not head.data.use_mirror_x


def test_the_tint_is_the_artists_own_and_stays_so(head):
    click, paint = bpy.ops.wildcap, bpy.context.scene.tool_settings.image_paint
    click.paint_mask()
    assert tuple(paint.stencil_color) == (1, 0, 0)
    paint.stencil_color = (0.0, 0.25, 1.0)
    space = next(area.spaces.active for area in bpy.context.screen.areas if area.type == 'VIEW_3D')
    space.overlay.texture_paint_mode_opacity = 0.75
    click.finish_mask()
    click.paint_mask(mask='PROTECT')
    assert paint.stencil_color[1] > paint.stencil_color[2]
    click.paint_mask(mask='SHADOW')
    assert tuple(paint.stencil_color) == (0.0, 0.25, 1.0) and space.overlay.texture_paint_mode_opacity == 0.75
    click.finish_mask()


def test_a_file_saved_while_painting_goes_on_painting_and_leaves_as_it_began(
    session, mask_image, capture, head, paint_spot, tmp_path
):
    blend, path = str(tmp_path / "a.blend"), capture / "shadow_mask.png"
    bpy.ops.object.mode_set(mode='SCULPT')
    bpy.ops.wildcap.paint_mask(on='SHEET')
    painted = paint_spot(10)
    bpy.ops.wm.save_as_mainfile(filepath=blend)
    assert path.read_bytes() == painted and "wildcap_painting" not in bpy.context.scene
    bpy.ops.wm.read_homefile(use_empty=True)
    assert not session.active()
    bpy.ops.wm.open_mainfile(filepath=blend)
    assert session.active() and session.on_sheet() and bpy.context.mode == 'PAINT_TEXTURE'
    assert mask_image.grey_png(mask_image.mask_values(session.mask())) == painted
    painted = paint_spot(30)
    bpy.ops.wildcap.finish_mask()
    assert path.read_bytes() == painted and bpy.context.mode == 'SCULPT'
    assert "WildCap Mask Sheet" not in bpy.data.objects and "WildCap Mask" not in bpy.data.brushes
    bpy.ops.object.mode_set(mode='OBJECT')


@pytest.mark.parametrize("newer", ["file", "capture"])
def test_the_newer_mask_of_file_and_capture_wins_and_the_other_goes_to_the_history(
    session, mask_image, capture, head, paint_spot, tmp_path, newer
):
    blend, path = tmp_path / "a.blend", capture / "shadow_mask.png"
    bpy.ops.wildcap.paint_mask()
    mine, theirs = paint_spot(10), standin.plain((99,))
    session.save()
    session.mask().reload()
    session.mask().pack()
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    session.forget()
    path.write_bytes(theirs)
    os.utime(blend, (2e9, 2e9) if newer == "file" else (1e9, 1e9))
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    winner, loser = (mine, theirs) if newer == "file" else (theirs, mine)
    assert path.read_bytes() == winner == mask_image.grey_png(mask_image.mask_values(session.mask()))
    assert loser in [step.read_bytes() for step in (capture / "mask_history").iterdir()]
    bpy.ops.wildcap.finish_mask()
    assert path.read_bytes() == winner


def test_a_mask_that_somebody_else_puts_there_meanwhile_goes_to_the_history(session, capture, head, paint_spot):
    bpy.ops.wildcap.paint_mask()
    paint_spot(10)
    session.save()
    theirs = standin.plain((99,))
    (capture / "shadow_mask.png").write_bytes(theirs)
    paint_spot(20)
    bpy.ops.wildcap.finish_mask()
    assert [step.read_bytes() for step in (capture / "mask_history").iterdir()] == [theirs]
