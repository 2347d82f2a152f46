# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A delivery as a word of the terminal."""

import contextlib
import time
from pathlib import Path

import bpy

from ...core.settings import delivery_presets
from .. import captures, head, jobs, problems
from ..terminal import Command
from . import waiting

POLL_S = 0.1  # between two looks at the worker


def _deliver(arguments) -> list[Path]:
    """The delivery's folder. Empties the open file first. Raises Problem as the buttons do."""
    bpy.ops.wm.read_homefile(use_empty=True)
    item = captures.add(bpy.context, arguments.capture.absolute())
    obj = head.bring_in(bpy.context, item)
    if arguments.what == "head":
        head.complete(obj, captures.folder(item))
        if delivery_presets.PRESETS[arguments.preset].open_eyes and not obj.data.shape_keys:
            bpy.ops.wildcap.add_face_units()
    chosen = item.deliver
    chosen.what, chosen.preset, chosen.format = arguments.what, arguments.preset, arguments.format
    chosen.folder = str(arguments.to or "")
    root = captures.root(item)
    with contextlib.suppress(RuntimeError):  # what the button refuses, it has told
        bpy.ops.wildcap.deliver('EXEC_DEFAULT')
    while jobs.poll():
        time.sleep(POLL_S)
    if waiting.ready(root) is not None:  # no window, no click: the mesh is added here
        return [waiting.finish(bpy.context, item)]
    told = problems.of(root)
    if told is not None and not isinstance(told, problems.Notice):
        raise told
    return [waiting.last(root)]


def _of_deliver(kind) -> None:
    kind.add_argument("capture", type=Path)
    kind.add_argument("--preset", choices=tuple(delivery_presets.PRESETS), default="blender")
    kind.add_argument("--format", choices=("preset", *delivery_presets.FORMATS), default="preset")
    kind.add_argument("--what", choices=tuple(delivery_presets.WHAT), default="head")
    kind.add_argument("--to", type=Path, metavar="FOLDER", help="where to; default: exports in the capture")


COMMANDS = (Command("deliver", "the head with its maps as another program wants them", _of_deliver, _deliver),)
