# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Video or photographs of a face: chosen in the file browser, or dropped on a 3D view with the WildCap tab."""

import re
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ...core.capture import photographs
from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from .. import captures, preferences, problems
from ..base_operator import FileOperator
from ..base_panel import WildcapPanel

VIDEOS = (".mp4", ".mov", ".m4v", ".mkv", ".avi", ".webm")
PHOTOGRAPHS = (*photographs.SUFFIXES, *photographs.UNREAD_SUFFIXES)
"""Formats that the stage frames reads, or explains how to convert."""
WIDTH_PX = 240
"""Width of the file browser's sidebar, pixels."""


class WILDCAP_OT_choose_video(FileOperator, bpy.types.Operator):
    """Choose the video of a face, or one of its photographs: all in that folder are used.

    A capture folder is made for it. A rig's folder holds one for each camera.
    """

    bl_idname = "wildcap.choose_video"
    bl_label = "Choose Video"
    bl_options = {'REGISTER', 'UNDO'}

    filepath: bpy.props.StringProperty(subtype='FILE_PATH', options={'SKIP_SAVE'})
    directory: bpy.props.StringProperty(subtype='DIR_PATH', options={'SKIP_SAVE', 'HIDDEN'})
    files: bpy.props.CollectionProperty(type=bpy.types.OperatorFileListElement, options={'SKIP_SAVE', 'HIDDEN'})
    alone: bpy.props.BoolProperty(
        name="Only This Photograph",
        description="Make a draft from the chosen photograph alone, not from all in its folder",
        options={'SKIP_SAVE'},
    )
    filter_glob: bpy.props.StringProperty(
        default=";".join(f"*{s};*{s.upper()}" for s in VIDEOS + PHOTOGRAPHS), options={'HIDDEN'}
    )

    def invoke(self, context, event):
        if self.filepath or self.files:  # dropped
            return self.execute(context)
        return super().invoke(context, event)

    def draw(self, context):
        """Draw the capture's place beside the file browser."""
        self.layout.prop(self, "alone")
        folder = preferences.captures_folder()
        problems.draw_text(self.layout, iface_("The capture goes to {}.").format(folder), WIDTH_PX)
        if not bpy.data.filepath and folder == preferences.captures_default():
            text = (
                "No cloud copies that folder. Choose another one in the preferences; captures of a saved .blend are "
                "stored beside it."
            )
            problems.draw_text(self.layout, text, WIDTH_PX)

    def work(self, context):
        folder = Path(bpy.path.abspath(self.directory))
        paths = [folder / file.name for file in self.files if file.name] if self.directory else []
        for source in sources(paths or [Path(bpy.path.abspath(self.filepath or self.directory))], self.alone):
            capture = Capture(new_folder(preferences.captures_folder(), source))
            capture.set_source(source)
            captures.add(context, capture.root)


class WILDCAP_FH_source(bpy.types.FileHandler):
    """Handler of files dropped on a 3D view whose sidebar shows the WildCap tab.

    For pictures Blender then asks whether a reference image was meant.
    """

    bl_idname = "WILDCAP_FH_source"
    bl_label = "Face for WildCap"
    bl_import_operator = "wildcap.choose_video"
    bl_file_extensions = ";".join(VIDEOS + PHOTOGRAPHS)

    @classmethod
    def poll_drop(cls, context):
        area = context.area
        if area is None or area.type != 'VIEW_3D' or not area.spaces.active.show_region_ui:
            return False
        return any(
            region.type == 'UI' and region.active_panel_category == WildcapPanel.bl_category for region in area.regions
        )


def sources(files: list[Path], alone: bool = False) -> list[Path]:
    """Return the sources among chosen files: each video, and the folders of photographs, or each `alone`.

    Raises Problem for others.
    """
    paths = []
    for path in files:
        if not path.exists() or path == Path():
            raise Problem(f"There is no file or folder {path}.", "Choose a video, or a folder of photographs.")
        if path.is_file() and path.suffix.lower() not in VIDEOS:
            if not photographs.is_photograph(path):
                raise Problem(
                    f"{path.name} is neither a video nor a photograph.",
                    f"Choose one of {', '.join(s[1:] for s in VIDEOS)}, or a folder of photographs.",
                )
            path = path if alone else path.parent
        if path.is_dir() and not has_photographs(path):
            raise Problem(f"There are no photographs in {path}.", "Choose a video, or a folder of photographs.")
        paths.append(path.absolute())
    return list(dict.fromkeys(paths))


def has_photographs(folder: Path) -> bool:
    """Return whether a folder, or those of a rig's cameras in it, hold photographs."""
    listed = photographs.list_photographs(folder)
    return bool(listed.files or listed.unread)


def new_folder(parent: Path, source: Path) -> Path:
    """Return parent/NAME.wildcap of a source: its existing folder, or a new one, numbered if the name is taken."""
    name = re.sub(r'[<>:"/\\|?*\x00-\x1f]', "_", source.stem if source.is_file() else source.name).strip(" .") or "face"
    for number in range(1, 1000):
        folder = parent / (f"{name}.wildcap" if number == 1 else f"{name}_{number}.wildcap")
        if not folder.exists() or (Capture(folder).json.is_file() and Capture(folder).source == source):
            return folder
    raise Problem(
        f"{parent} contains a thousand captures named {name}.", "Choose another captures folder in the preferences."
    )


CLASSES = (WILDCAP_OT_choose_video, WILDCAP_FH_source)
