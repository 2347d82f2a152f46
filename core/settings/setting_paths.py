# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Check the files and folders that settings name before any stage runs."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import Field, fields
from pathlib import Path

from ..capture.messages import Problem
from ..capture.together import captures_in
from .setting_values import PATHS
from .settings import Settings

LONGEST_SHOWN = 300
"""Characters of a path that a message shows."""


def check_paths(settings: Settings, stages: Iterable[str]) -> None:
    """Raise Problem if a file or folder that one of these stages needs is not set, missing, or lacks files."""
    for stage in stages:
        own = getattr(settings, stage)
        for field in fields(own):
            if "path" in field.metadata and field.metadata.get("when", lambda own: True)(own):
                _check(f"{stage}.{field.name}", field, getattr(own, field.name).strip())


def _check(name: str, field: Field, value: str) -> None:
    about = field.metadata
    setting = f"{about['flag']} ({name})" if "flag" in about else name
    advice = f"Choose {PATHS[about['path']]}{' with ' + ' and '.join(about['holds']) if 'holds' in about else ''}."
    if not value:
        if about.get("required"):
            raise Problem(f"{setting} is empty.", advice)
        return
    path = Path(os.path.expanduser(value))
    if not os.path.exists(path):  # Path.exists raises an error for a name that is too long
        raise Problem(
            f"There is no file or folder at {str(path)[:LONGEST_SHOWN]}, the value of {setting}.",
            "Check its name, and that its disk is connected.",
        )
    if (about["path"] == "folder" and not path.is_dir()) or (about["path"] == "file" and not path.is_file()):
        raise Problem(f"{path}, the value of {setting}, is not a {about['path']}.", advice)
    missing = [file for file in about.get("holds", ()) if path.is_dir() and not (path / file).is_file()]
    if missing:
        raise Problem(f"{path}, the value of {setting}, contains no {missing[0]}.", advice)
    if name == "solve.together":
        captures_in(value)
    if name == "registration.template":
        check_template(path)


def check_template(path: Path) -> None:
    """Raise Problem for a path that is neither an OBJ nor a folder with a neutral one, beside its shapes."""
    if not (path.is_file() and path.suffix.lower() == ".obj" or path.is_dir()):
        raise Problem(
            f"{path} is neither an OBJ nor a folder.",
            "Choose an OBJ of a head, or a folder with a neutral OBJ and its shapes.",
        )
    shapes = (*path.glob("*.obj"), *path.glob("*/*.obj")) if path.is_dir() else ()
    if path.is_dir() and not any("neutral" in file.name.lower() for file in shapes):
        raise Problem(
            f"{path} contains no OBJ with 'neutral' in its name.",
            "Choose the OBJ itself, or the folder of shapes (FaceXModel in ICT-FaceKit).",
        )
