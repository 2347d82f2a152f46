# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Leaving a painting session in the window gives the artist's things back."""

import addon
import bpy
import driver as d
import painting


def flow():
    yield from addon.open_sample_head()
    own_things()
    for mode, protect in (('SCULPT', False), ('TEXTURE_PAINT', True)):
        yield from leave(mode, protect)


def own_things() -> None:
    """What an artist has set up for another project: brush, colours, canvas, stencil, and a view that looks different
    from ours in everything."""
    space, paint = d.view().spaces.active, bpy.context.scene.tool_settings.image_paint
    space.shading.light, space.shading.color_type = 'MATCAP', 'RANDOM'
    space.overlay.show_overlays, space.overlay.texture_paint_mode_opacity = False, 0.35
    activate_cube('TEXTURE_PAINT')
    brush = bpy.data.brushes.new("My Brush", mode='TEXTURE_PAINT')
    brush.asset_mark()
    bpy.ops.brush.asset_activate(asset_library_type='LOCAL', relative_asset_identifier="Brush/My Brush")
    brush.color, brush.size, brush.strength = (0.1, 0.7, 0.3), 77, 0.4
    unified = bpy.context.scene.tool_settings.unified_paint_settings
    unified.size, unified.use_unified_size, unified.use_unified_color, unified.color = 123, True, True, (0.9, 0.2, 0.6)
    paint.mode, paint.canvas = 'IMAGE', bpy.data.images.new("My Canvas", 8, 8)
    paint.stencil_image = bpy.data.images.new("My Stencil", 8, 8)
    paint.stencil_color, paint.invert_stencil = (0.25, 0.5, 0.75), True
    bpy.ops.object.mode_set(mode='OBJECT')


def leave(mode: str, protect: bool):
    """From a mode on something else into the painting, a stroke, a setting of the brush, and back."""
    activate_cube(mode)
    bpy.ops.ed.undo_push()
    yield from d.park()
    before = state()
    bpy.ops.wildcap.paint_mask(mask='PROTECT' if protect else 'SHADOW')
    yield from painting.in_hand()
    yield from painting.visible_dab(*d.middle())
    brush = bpy.context.scene.tool_settings.image_paint.brush
    brush.size, brush.strength, bpy.context.object.data.use_mirror_x = 25, 0.5, not bpy.context.object.data.use_mirror_x
    yield from d.lead("wildcap.finish_mask")
    yield 0.5
    after = state()
    assert after == before, {name: (before[name], after[name]) for name in before if before[name] != after[name]}
    d.say(f"left as it was: {before['mode']}, {len(before)} values")
    bpy.ops.object.mode_set(mode='OBJECT')


def activate_cube(mode: str) -> None:
    bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
    bpy.ops.object.mode_set(mode=mode)


def state() -> dict:
    """All there is to read of the brush, the paint settings, shading, overlays and mode, as plain values."""
    space, tools = d.view().spaces.active, bpy.context.scene.tool_settings
    paint = tools.image_paint
    things = {
        "paint": paint,
        "brush": paint.brush,
        "unified": tools.unified_paint_settings,
        "asset": paint.brush_asset_reference,
        "weights": tools.weight_paint,
        "sculpting": tools.sculpt,
        "shading": space.shading,
        "overlay": space.overlay,
    }
    values = {
        f"{name}.{key}": value
        for name, thing in things.items()
        if thing is not None
        for key, value in plain(thing).items()
    }
    layer = bpy.context.view_layer
    for thing in layer.objects:
        values[thing.name] = (
            thing.mode,
            thing.select_get(),
            thing.hide_get(),
            thing.data.use_mirror_x if thing.type == 'MESH' else None,
        )
    return {
        **values,
        "mode": bpy.context.mode,
        "active": layer.objects.active.name,
        "brushes": sorted(b.name for b in bpy.data.brushes),
    }


def plain(thing) -> dict:
    """Every property of a Blender thing that has a value of its own, or the name of a data-block."""
    found = {}
    for each in thing.bl_rna.properties:
        value = getattr(thing, each.identifier)
        if each.type == 'POINTER':
            found[each.identifier] = value.name if isinstance(value, bpy.types.ID) else None
        elif each.type != 'COLLECTION':
            found[each.identifier] = (
                tuple(value) if getattr(each, "is_array", False) else sorted(value) if isinstance(value, set) else value
            )
    return found
