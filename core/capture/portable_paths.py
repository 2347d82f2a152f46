# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths in a capture's own files: relative to the capture if the target would travel with it."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

from ..settings.settings import STAGE_KINDS


def write_portable(path: str | Path, root: Path) -> str:
    """Return a path for a file of the capture folder `root`: relative, with forward slashes, if both can move together.

    Else it is absolute: nobody moves a disk's top folder, a home folder or the parents of one.
    """
    path, root = os.path.abspath(os.path.expanduser(path)), os.path.abspath(root)
    try:
        shared = os.path.commonpath([path, root])
    except ValueError:  # on two drives of Windows
        return path
    home = Path.home()
    if os.path.ismount(shared) or Path(shared) in (home, *home.parents):
        return path
    return Path(os.path.relpath(path, root)).as_posix()


def read_portable(text: str, root: Path) -> Path:
    """Return the absolute path that `write_portable` wrote for the capture folder `root`."""
    return Path(os.path.abspath(os.path.join(root, text)))


def convert_settings(by_stage: dict, convert: Callable[[str], str]) -> dict:
    """Apply `convert` to every path that is set in {stage: {name: value}}, which may hold other things too."""
    converted = dict(by_stage)
    for stage, settings in by_stage.items():
        if isinstance(settings, dict):
            paths = {f.name for f in fields(STAGE_KINDS[stage]) if "path" in f.metadata} if stage in STAGE_KINDS else ()
            converted[stage] = {
                name: convert(value) if name in paths and value else value for name, value in settings.items()
            }
    return converted
