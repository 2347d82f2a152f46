# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths as a capture's own files hold them: relative to the capture where what they name would travel with it, so that
a copy on another disk still works.

Standard library only.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

from ..settings.settings import Settings


def write_portable(path: str | Path, root: Path) -> str:
    """A path for a file of the capture folder `root`: relative with forward slashes where both lie in one folder that
    somebody may move, else absolute.

    Nobody moves a disk's top folder, a home folder or the one that holds the homes: what has only these in common is
    not moved together.
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
    """The absolute path that `write_portable` wrote for the capture folder `root`."""
    return Path(os.path.abspath(os.path.join(root, text)))


def convert_settings(by_stage: dict, convert: Callable[[str], str]) -> dict:
    """The settings of stages, {stage: {name: value}} among other things, with `convert` applied to every path that is
    given."""
    kinds = {name: getattr(Settings(), name, None) for name in by_stage}
    paths = {
        name: {f.name for f in fields(kind) if "path" in f.metadata} if hasattr(kind, "__dataclass_fields__") else set()
        for name, kind in kinds.items()
    }
    return {
        stage: {name: convert(value) if name in paths[stage] and value else value for name, value in chosen.items()}
        if isinstance(chosen, dict)
        else chosen
        for stage, chosen in by_stage.items()
    }
