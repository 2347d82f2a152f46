# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels: the list of layers, and brushes and sources while one is painted."""

import bpy

from .. import captures, layers, problems, status
from ..base_panel import CapturePanel, region_width
from . import brush, layer_update, session
from .layer_operators import BRUSHES

MAP_ICONS = {"albedo": 'COLOR', "specular": 'SHADING_RENDERED', "normal": 'NORMALS_FACE'}


class WILDCAP_UL_layers(bpy.types.UIList):
    """Rows of layers, the highest first."""

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index):
        row = layout.row(align=True)
        row.prop(item, "visible", text="", icon='HIDE_OFF' if item.visible else 'HIDE_ON', emboss=False)
        row.label(text="", icon='ERROR' if _change(data, item.file) else MAP_ICONS.get(item.map, 'COLOR'))
        row.prop(item, "name", text="", emboss=False)
        slider = row.row(align=True)
        slider.scale_x = 0.7
        slider.prop(item, "opacity", text="")
        row.prop(item, "locked", text="", icon='LOCKED' if item.locked else 'UNLOCKED', emboss=False)


class WILDCAP_PT_retouch(CapturePanel, bpy.types.Panel):
    bl_label = "Retouch"
    bl_order = 45

    def draw(self, context):
        layout, item = self.layout, captures.active(context)
        row = layout.row(align=True)
        row.operator_menu_enum("wildcap.layer_add", "map", text="New Layer", icon='ADD')
        row.operator("wildcap.layer_import", text="", icon='FILE_FOLDER')
        layout.prop(context.scene.wildcap, "layer_side")
        if not len(item.layers):
            return
        row = layout.row()
        row.template_list("WILDCAP_UL_layers", "", item, "layers", item, "active_layer", rows=3)
        column = row.column(align=True)
        column.operator("wildcap.layer_move", text="", icon='TRIA_UP').up = True
        column.operator("wildcap.layer_move", text="", icon='TRIA_DOWN').up = False
        column.separator()
        column.operator("wildcap.layer_remove", text="", icon='TRASH')
        row = layout.row(align=True)
        row.operator("wildcap.layer_paint", text="On the Head", icon='BRUSH_DATA').on = 'HEAD'
        row.operator("wildcap.layer_paint", text="On the Flat Sheet", icon='MESH_PLANE').on = 'SHEET'
        change = _change(item, layers.active_file(item))
        if change:
            words = f"The skin below has changed by up to {change:.0f} delta E since this layer was painted."
            problems.draw_text(layout.column(), words, region_width(context), 'ERROR')
            layout.operator("wildcap.layer_keep", icon='CHECKMARK')
        if layer_update.is_outdated(item):
            layout.operator("wildcap.layer_update", icon='FILE_REFRESH')


def draw_painting(layout, context) -> None:
    """Draw the brushes of a layer's painting."""
    painted = session.layer()
    layout.label(text=painted.layer.name, icon=MAP_ICONS[painted.layer.map], translate=False)
    row = layout.row(align=True)
    for text, on in (("On the Head", 'HEAD'), ("On the Flat Sheet", 'SHEET')):
        row.operator("wildcap.layer_paint", text=text, depress=session.on_sheet() == (on == 'SHEET')).on = on
    paint = context.scene.tool_settings.image_paint
    grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
    in_hand = painted.brush if _is_ours(paint, painted.brush) else brush.kind_of(paint.brush)
    for kind, text, _, icon, _ in BRUSHES:
        if kind != 'FRAME' or session.offered() == 'FRAME':
            grid.operator("wildcap.layer_brush", text=text, icon=icon, depress=kind == in_hand).kind = kind
    if painted.is_colour:
        layout.operator_menu_enum("wildcap.layer_frame", "frame", icon='IMAGE_DATA')
    if paint.brush is not None:
        layout.prop(paint.brush, "size", slider=True)
        layout.prop(paint.brush, "strength", slider=True)
        if in_hand == 'DRAW':
            layout.prop(paint.brush, "color", text="")
    if context.object is not None and context.object.type == 'MESH':  # a stroke follows its mesh's symmetry
        layout.prop(context.object.data, "use_mirror_x", text="Mirror Left and Right")
    layout.operator("wildcap.layer_heal", icon='HEART')


def _is_ours(paint, kind: str) -> bool:
    """Return whether the brush of that kind is still in hand: the artist may have taken another one."""
    return brush.kind_of(paint.brush) == ('CLONE' if kind in ('BELOW', 'MIRROR', 'FRAME') else kind)


def _change(item, file: str) -> float:
    """Return by how much the skin below a layer has changed, CIE delta E; 0 for little."""
    known = status.of(item)
    return known.layers_changed.get(file, 0.0) if known is not None else 0.0


CLASSES = (WILDCAP_UL_layers, WILDCAP_PT_retouch)
