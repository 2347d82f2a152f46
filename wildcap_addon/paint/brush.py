# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Brushes of a painting: Blender 4.2 assigns them, later versions activate them as assets.

A MASK brush paints its weight into the stencil image, the opposite with Ctrl held.
"""

import contextlib

import bpy

RADIUS_PX = 40  # initial radius of the brush


def activate(context, name: str, kind: str) -> dict:
    """Activate a brush of ours, of that kind, in Texture Paint mode, and return what `restore` needs."""
    paint = context.scene.tool_settings.image_paint
    before = {
        "ours": name,
        "kind": kind,
        "brush": paint.brush.name if paint.brush else "",
        "reference": _reference(paint),
        "brushes": [b.name for b in bpy.data.brushes],
    }
    brush = bpy.data.brushes.get(name) or bpy.data.brushes.new(name, mode='TEXTURE_PAINT')
    set_kind(brush, kind)
    brush.weight = brush.strength = 1.0
    if bpy.app.version >= (4, 3, 0):
        brush.asset_mark()
        bpy.ops.brush.asset_activate(asset_library_type='LOCAL', relative_asset_identifier=f"Brush/{brush.name}")
    else:
        paint.brush = brush
    unified = _unified(context.scene)
    before["unified"] = {
        name: getattr(unified, name)
        for name in ("use_unified_size", "use_unified_strength", "use_unified_weight")
        if hasattr(unified, name)
    }
    for name in before["unified"]:
        setattr(unified, name, False)
    brush.size = RADIUS_PX * (2 if bpy.app.version >= (5, 0, 0) else 1)  # 5.0 counts diameters
    return before


def restore(context, before: dict) -> None:
    """Restore the brush; ours is removed, as is the one that Blender linked from its library for the mask tool."""
    unified = _unified(context.scene)
    for name, value in before["unified"].items():
        setattr(unified, name, value)
    paint = context.scene.tool_settings.image_paint
    reference = before["reference"]
    painting = context.mode == 'PAINT_TEXTURE'  # otherwise Blender crashes: the head is gone or excluded
    with contextlib.suppress(RuntimeError):  # its library may be missing
        if painting and reference is not None and reference["relative_asset_identifier"]:
            bpy.ops.brush.asset_activate(**reference)
    other = before["brush"] and (paint.brush is None or paint.brush.name != before["brush"])
    if other and before["brush"] in bpy.data.brushes:
        with contextlib.suppress(AttributeError):  # read-only since 5.0
            paint.brush = bpy.data.brushes[before["brush"]]
    for each in list(bpy.data.brushes):
        if each.name == before["ours"] or each != paint.brush and _came_with_tool(each, before):
            bpy.data.brushes.remove(each)


@contextlib.contextmanager
def keep_active(context):
    """Keep the active brush while the mode is entered anew.

    Blender 4.2 activates its tool's own brush then, which paints on the texture in place of the mask.
    """
    paint = context.scene.tool_settings.image_paint
    active = paint.brush
    yield
    if bpy.app.version < (4, 3, 0):
        paint.brush = active


def _came_with_tool(brush, before: dict) -> bool:
    return (
        brush.library is not None
        and getattr(brush, _type_property(brush)) == before["kind"]
        and brush.name not in before.get("brushes", [brush.name])
    )


def _reference(paint) -> dict | None:
    reference = getattr(paint, "brush_asset_reference", None)
    names = ("asset_library_type", "asset_library_identifier", "relative_asset_identifier")
    return {name: getattr(reference, name) for name in names} if reference is not None else None


def set_kind(brush, kind: str) -> None:
    """Give a brush a kind: DRAW, SOFTEN, SMEAR, CLONE, FILL or MASK."""
    setattr(brush, _type_property(brush), kind)


def kind_of(brush) -> str:
    """Return the kind of a brush, '' for none."""
    return getattr(brush, _type_property(brush)) if brush is not None else ""


def _type_property(brush) -> str:
    return "image_brush_type" if hasattr(brush, "image_brush_type") else "image_tool"


def _unified(scene):
    settings = scene.tool_settings
    return getattr(settings, "unified_paint_settings", None) or settings.image_paint.unified_paint_settings
