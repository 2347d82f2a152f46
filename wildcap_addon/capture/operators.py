# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that say which face: choose a video, open a capture folder, take one off the list."""

import re
from pathlib import Path

import bpy

from ...core.capture import Capture
from ...core.messages import Problem
from .. import captures, preferences
from ..base_operator import BaseOperator

VIDEO_SUFFIXES = ("mp4", "mov", "m4v", "mkv", "avi", "webm")


class WILDCAP_OT_choose_video(BaseOperator, bpy.types.Operator):
    """Choose the video of a face, or a folder of photographs; a capture folder is made for it"""

    bl_idname = "wildcap.choose_video"
    bl_label = "Choose Video"

    filepath: bpy.props.StringProperty(subtype='FILE_PATH')
    filter_glob: bpy.props.StringProperty(default=";".join(f"*.{s};*.{s.upper()}" for s in VIDEO_SUFFIXES), options={'HIDDEN'})

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {'RUNNING_MODAL'}

    def work(self, context):
        source = Path(bpy.path.abspath(self.filepath))
        if not source.exists() or not self.filepath:
            raise Problem(f"There is no file or folder {source}.", "Choose a video, or a folder of photographs.")
        capture = Capture(new_folder(preferences.captures_folder(), source))
        capture.set_source(source)
        captures.add(context, capture.root)


class WILDCAP_OT_open_capture(BaseOperator, bpy.types.Operator):
    """Open a capture folder that exists"""

    bl_idname = "wildcap.open_capture"
    bl_label = "Open Capture"

    directory: bpy.props.StringProperty(subtype='DIR_PATH')

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {'RUNNING_MODAL'}

    def work(self, context):
        root = Path(bpy.path.abspath(self.directory)).absolute()
        capture = Capture(root)
        if not capture.json.is_file() and not capture.head.is_file():
            raise Problem(f"{root} is not a capture.", "Choose a folder that ends in .wildcap.")
        capture.read()  # refuses a damaged or newer one
        captures.add(context, root)


class WILDCAP_OT_close_capture(BaseOperator, bpy.types.Operator):
    """Take the capture off this list; its folder stays"""

    bl_idname = "wildcap.close_capture"
    bl_label = "Close Capture"

    def work(self, context):
        props = context.scene.wildcap
        item = captures.require(context)
        index = next(i for i, other in enumerate(props.captures) if other == item)
        props.captures.remove(index)
        props.active_index = max(0, min(index, len(props.captures) - 1))


class WILDCAP_OT_open_report(BaseOperator, bpy.types.Operator):
    """Open the report in the browser: a picture and the figures of every stage, and what is wrong with the video"""

    bl_idname = "wildcap.open_report"
    bl_label = "Open Report"

    @classmethod
    def poll(cls, context):
        return captures.active(context) is not None

    def work(self, context):
        report = captures.folder(captures.require(context)).report
        if not report.is_file():
            raise Problem("There is no report yet.", "Click Reconstruct: the report is written as its stages finish.")
        bpy.ops.wm.url_open(url=report.absolute().as_uri())


def new_folder(parent: Path, source: Path) -> Path:
    """parent/NAME.wildcap for a source; the same source finds its folder again, another one of the same name gets a number."""
    name = re.sub(r'[<>:"/\\|?*\x00-\x1f]', "_", source.stem if source.is_file() else source.name).strip(" .") or "face"
    for number in range(1, 1000):
        folder = parent / (f"{name}.wildcap" if number == 1 else f"{name}_{number}.wildcap")
        if not folder.exists() or (Capture(folder).json.is_file() and Capture(folder).read().get("source") == str(source)):
            return folder
    raise Problem(f"{parent} holds a thousand captures named {name}.", "Choose another captures folder in the preferences.")


CLASSES = (WILDCAP_OT_choose_video, WILDCAP_OT_open_capture, WILDCAP_OT_close_capture, WILDCAP_OT_open_report)
