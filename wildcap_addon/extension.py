# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Name of the extension's package in Blender, bl_ext.REPOSITORY.wildcap, and the files of its user folder."""

from pathlib import Path

import bpy

NAME = __package__.rpartition(".")[0]


def user_file(name: str) -> Path:
    """Return a path in the extension's user folder, which is kept across updates."""
    return Path(bpy.utils.extension_path_user(NAME, create=True)) / name
