# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that choose the artist's own head mesh, and compare a frame before and after delighting."""

from pathlib import Path

import bpy

from ...core.capture.files import storage_problem
from ...core.settings.setting_paths import check_template
from .. import captures
from ..base_operator import BaseOperator, CaptureOperator, FileOperator
from . import delighters


class WILDCAP_OT_use_active_mesh(BaseOperator, bpy.types.Operator):
    """Fit the active mesh as well, and bake the maps into its UVs.

    The capture stores it as it is now, without its modifiers.
    """

    bl_idname = "wildcap.use_active_mesh"
    bl_label = "Use Active Mesh"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        thing = context.view_layer.objects.active
        return (
            cls.in_object_mode(context)
            and cls.with_capture(context)
            and cls.allowed(
                thing is not None and thing.type == 'MESH', "Make a head mesh of your own the active object first"
            )
            and cls.allowed(
                captures.HEAD_KEY not in thing,
                "This is the capture's own head or scan: make a head mesh of your own the active object",
            )
        )

    def work(self, context):
        item, thing = captures.require(context), context.view_layer.objects.active
        path = captures.folder(item).root / "template" / f"{bpy.path.clean_name(thing.name)}.obj"
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise storage_problem(error, path) from error
        selection = list(context.selected_objects)
        for other in context.view_layer.objects:
            other.select_set(other == thing)
        try:
            bpy.ops.wm.obj_export(
                filepath=str(path),
                export_selected_objects=True,
                apply_modifiers=False,
                export_materials=False,
                export_normals=False,
                forward_axis='Y',
                up_axis='Z',
            )
        finally:
            for other in context.view_layer.objects:
                other.select_set(other in selection)
        item.registration.template = str(path)


class WILDCAP_OT_choose_template(FileOperator, CaptureOperator, bpy.types.Operator):
    """Fit a head mesh of your own as well: an OBJ, or a folder with a neutral OBJ and its shapes, like ICT-FaceKit.

    The maps are baked into its UVs.
    """

    bl_idname = "wildcap.choose_template"
    bl_label = "Choose Head Mesh"
    bl_options = {'REGISTER', 'UNDO'}

    filepath: bpy.props.StringProperty(subtype='FILE_PATH', options={'SKIP_SAVE'})
    filter_glob: bpy.props.StringProperty(default="*.obj;*.OBJ", options={'HIDDEN'})

    def work(self, context):
        path = Path(bpy.path.abspath(self.filepath)).absolute()
        check_template(path)
        captures.require(context).registration.template = str(path)


class WILDCAP_OT_use_built_in_head(BaseOperator, bpy.types.Operator):
    """Fit only the built-in head."""

    bl_idname = "wildcap.use_built_in_head"
    bl_label = "Use Built-In Head Only"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        return cls.with_capture(context) and cls.allowed(
            captures.active(context).registration.template, "The built-in head is fitted alone already"
        )

    def work(self, context):
        captures.require(context).registration.template = ""


class WILDCAP_OT_compare_delit(CaptureOperator, bpy.types.Operator):
    """Show a frame before and after delighting; click again for the next one."""

    bl_idname = "wildcap.compare_delit"
    bl_label = "Before and After"

    which: bpy.props.IntProperty(
        name="Frame", default=-1, options={'SKIP_SAVE'}, description="Number of the delit frame; -1: the next one"
    )

    def work(self, context):
        capture = captures.folder(captures.require(context))
        names = delighters.frames(capture)
        before = delighters.shown_frame(capture)
        next_index = names.index(before) + 1 if before in names else len(names) // 2
        delighters.show(capture, self.which if self.which >= 0 else next_index, context.window_manager.wildcap_wipe)


CLASSES = (
    WILDCAP_OT_use_active_mesh,
    WILDCAP_OT_choose_template,
    WILDCAP_OT_use_built_in_head,
    WILDCAP_OT_compare_delit,
)
