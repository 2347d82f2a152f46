# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators on the list of captures: open a folder, find one that was moved, remove one, show its report."""

from pathlib import Path

import bpy

from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from .. import captures, links
from ..base_operator import CaptureOperator, FileOperator


class WILDCAP_OT_open_capture(FileOperator, bpy.types.Operator):
    """Open an existing capture folder."""

    bl_idname = "wildcap.open_capture"
    bl_label = "Open Capture"
    bl_options = {'REGISTER', 'UNDO'}

    directory: bpy.props.StringProperty(subtype='DIR_PATH')

    def work(self, context):
        root = Path(bpy.path.abspath(self.directory)).absolute()
        if not links.is_capture(root):
            raise Problem(f"{root} is not a capture.", "Choose a folder that ends in .wildcap.")
        Capture(root).read()  # refuses a damaged or newer one
        captures.add(context, root)


class WILDCAP_OT_locate_capture(FileOperator, CaptureOperator, bpy.types.Operator):
    """Find the folder of a capture that was moved: beside the .blend, among your captures, or where you choose.

    Others that were moved with it are found as well.
    """

    bl_idname = "wildcap.locate_capture"
    bl_label = "Locate Capture"
    bl_options = {'REGISTER', 'UNDO'}

    directory: bpy.props.StringProperty(subtype='DIR_PATH', options={'SKIP_SAVE'})

    def invoke(self, context, event):
        item = captures.require(context)
        if not captures.folder(item).root.is_dir() and links.find(item) is not None:
            return self.execute(context)
        return super().invoke(context, event)

    def work(self, context):
        item = captures.require(context)
        name = links.name(item)
        if not self.directory and captures.folder(item).root.is_dir():
            raise Problem(
                f"{name} is where it was.", "To work on another copy of it, click Locate Capture and choose its folder."
            )
        folder = Path(bpy.path.abspath(self.directory)).absolute() if self.directory else links.find(item)
        if folder is None:
            raise Problem(
                f"{name} is neither beside this .blend nor among your captures.",
                "Click Locate Capture and choose the folder it is in now.",
            )
        place = next((path for path in (folder, folder / name) if links.is_capture(path)), None)
        if place is None:
            raise Problem(
                f"{folder} is not a capture folder, and contains no {name}.",
                "Choose the folder that ends in .wildcap, or its parent folder.",
            )
        Capture(place).read()  # refuses a damaged or newer one
        links.move(item, place)
        for other in links.missing():
            if links.is_capture(place.parent / links.name(other)):
                links.move(other, place.parent / links.name(other))


class WILDCAP_OT_close_capture(CaptureOperator, bpy.types.Operator):
    """Remove the capture from this list; its folder stays."""

    bl_idname = "wildcap.close_capture"
    bl_label = "Close Capture"
    bl_options = {'REGISTER', 'UNDO'}

    def work(self, context):
        items = context.scene.wildcap.captures
        index = list(items).index(captures.require(context))
        captures.remove(context.scene.wildcap, index, index)


class WILDCAP_OT_open_report(CaptureOperator, bpy.types.Operator):
    """Open the report in the browser: pictures and figures of every stage, and problems of the video."""

    bl_idname = "wildcap.open_report"
    bl_label = "Open Report"

    def work(self, context):
        report = captures.folder(captures.require(context)).report
        if not report.is_file():
            raise Problem("There is no report yet.", "Click Reconstruct: the report is written as its stages finish.")
        bpy.ops.wm.url_open(url=report.absolute().as_uri())


CLASSES = (WILDCAP_OT_open_capture, WILDCAP_OT_locate_capture, WILDCAP_OT_close_capture, WILDCAP_OT_open_report)
