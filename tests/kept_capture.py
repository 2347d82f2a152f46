# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A capture whose folder holds nothing yet, what lies in one, and frames written as a stage writes them: what ownership
is tested with."""

from pathlib import Path

from core.capture import ownership
from core.capture.capture import Capture
from core.capture.files import replacing_folder


def make(root: Path) -> Capture:
    """A capture with nothing in it."""
    capture = Capture(root)
    capture.claim()
    return capture


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != ownership.RECORD
    }


def make_frames(capture: Capture, *names: str, text: str = "frame") -> None:
    with replacing_folder(capture.frames) as folder:
        for name in names:
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_text(text)
