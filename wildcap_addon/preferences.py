# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's preferences: the Python that runs the solver, and where captures go."""

from pathlib import Path

import bpy

from .. import __package__ as base_package


class WILDCAP_AP_preferences(bpy.types.AddonPreferences):
    bl_idname = base_package

    python: bpy.props.StringProperty(
        name="Solver Python", subtype='FILE_PATH',
        description="Python that runs the solver, with the packages of requirements/worker.txt installed",
    )
    environment: bpy.props.StringProperty(
        name="Solver Folder", subtype='DIR_PATH',
        description="Where Install Solver puts its packages; empty: in the extension's own user folder",
    )
    captures: bpy.props.StringProperty(
        name="Captures Folder", subtype='DIR_PATH',
        description="Where new captures go while the .blend is not saved; empty: WildCap in the documents folder",
    )

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "python")
        layout.prop(self, "environment")
        layout.prop(self, "captures")


def get() -> WILDCAP_AP_preferences:
    return bpy.context.preferences.addons[base_package].preferences


def python() -> Path | None:
    """The solver's Python, if it is set and there."""
    path = bpy.path.abspath(get().python)
    return Path(path) if path and Path(path).is_file() else None


def set_python(path: Path | None) -> None:
    get().python = str(path or "")
    bpy.context.preferences.is_dirty = True  # Blender saves preferences on exit


def environment_folder() -> Path:
    """Where Install Solver makes its environment: kept across updates, outside the extension's own files."""
    chosen = get().environment
    return Path(bpy.path.abspath(chosen) if chosen else bpy.utils.extension_path_user(base_package, path="solver"))


def captures_folder(saved: bool = True) -> Path:
    """Beside the .blend; while it is unsaved (or with saved=False), the preferences' folder or WildCap in the user's documents."""
    if bpy.data.filepath and saved:
        return Path(bpy.data.filepath).parent
    chosen = get().captures
    return Path(bpy.path.abspath(chosen)) if chosen else Path.home() / "Documents" / "WildCap"


register, unregister = bpy.utils.register_classes_factory((WILDCAP_AP_preferences,))
