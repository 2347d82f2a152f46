# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The files and folders that settings name, checked before any stage runs. Standard library only."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import Field, fields
from pathlib import Path

from ..capture.messages import Problem
from ..capture.together import captures_in
from .setting_values import PATHS
from .settings import Settings


def check_paths(settings: Settings, stages: Iterable[str]) -> None:
    """Raise Problem where a file or folder that one of these stages needs was not chosen, is not there, or lacks what
    it has to hold."""
    for stage in stages:
        own = getattr(settings, stage)
        for field in fields(own):
            if "path" in field.metadata and field.metadata.get("when", lambda own: True)(own):
                _check(f"{stage}.{field.name}", field, getattr(own, field.name).strip())


def _check(name: str, field: Field, value: str) -> None:
    about = field.metadata
    setting = f"{about['flag']} ({name})" if "flag" in about else name
    if not value:
        if about.get("required"):
            raise Problem(f"{setting} is empty.", f"Choose {_describe(about)}.")
        return
    path = Path(os.path.expanduser(value))
    if not path.exists():
        raise Problem(
            f"There is no file or folder at {path}, which {setting} names.",
            "Check its name and whether the disk it is on is connected.",
        )
    if (about["path"] == "folder" and not path.is_dir()) or (about["path"] == "file" and not path.is_file()):
        raise Problem(f"{path}, which {setting} names, is not a {about['path']}.", f"Choose {_describe(about)}.")
    missing = [held for held in about.get("holds", ()) if path.is_dir() and not (path / held).is_file()]
    if missing:
        raise Problem(f"{path}, which {setting} names, holds no {missing[0]}.", f"Choose {_describe(about)}.")
    if name == "solve.together":
        captures_in(value)


def _describe(about) -> str:
    return PATHS[about["path"]] + (f" with {' and '.join(about['holds'])}" if "holds" in about else "")
