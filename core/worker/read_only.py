# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A writable stand-in for a capture on a read-only disk, such as an archive's. Standard library only."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ..capture.capture import Capture
from ..capture.files import storage_problem
from ..capture.messages import Problem


@contextlib.contextmanager
def stand_in(capture: Capture, folder: str) -> Iterator[Capture]:
    """Yield the capture if it is writable, else a temporary one in `folder` with links to its files, or copies.

    Raises Problem if the folder is '' or read-only as well.
    """
    if _is_writable(capture.root):
        yield capture
        return
    if not folder:
        raise Problem(
            f"{capture.root} is read-only.",
            "Deliver to another folder: --to FOLDER, or Deliver To in the panel Deliver.",
        )
    place = Path(folder).expanduser() / f".wildcap.{os.getpid()}.tmp"
    try:
        try:
            _stand_in(capture.root, place / capture.root.name)
        except OSError as error:
            raise storage_problem(error, place) from error
        yield Capture(place / capture.root.name)
    finally:
        shutil.rmtree(place, ignore_errors=True)


def _stand_in(source: Path, target: Path) -> None:
    """Fill a new folder, which keeps its own mode: that of the source, as shutil.copytree gives it, is read-only."""
    target.mkdir(parents=True)
    for path in source.iterdir():
        if path.is_dir() and not path.name.startswith("."):
            _stand_in(path, target / path.name)
        elif path.name != "lock" and not path.name.startswith("."):
            _link(path, target / path.name)


def _link(source: Path, target: Path) -> None:
    """Link a file; copy records, which are written to, and where the system has no links."""
    if source.suffix not in (".json", ".jsonl"):
        with contextlib.suppress(OSError, NotImplementedError):
            os.symlink(source.absolute(), target)
            return
    shutil.copyfile(source, target)


def _is_writable(folder: Path) -> bool:
    """Return whether a file can be made in a folder; on Windows permissions alone do not tell."""
    try:
        with tempfile.TemporaryFile(dir=folder):
            return os.access(folder, os.W_OK)
    except OSError:
        return False
