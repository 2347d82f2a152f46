# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Terminal command for a delivery."""

import contextlib
import time
from pathlib import Path

import bpy

from ...core.settings import delivery_presets
from .. import captures, head, jobs, problems
from ..terminal import Command
from . import waiting

POLL_S = 0.1


def _deliver(options) -> list[Path]:
    """Deliver and return the folder; empties the open file first. Raises Problem as the buttons do."""
    bpy.ops.wm.read_homefile(use_empty=True)
    item = captures.add(bpy.context, options.capture.absolute())
    obj = head.bring_in(bpy.context, item)
    if options.what == "head":
        head.complete(obj, captures.folder(item))
        if delivery_presets.PRESETS[options.preset].open_eyes and not obj.data.shape_keys:
            bpy.ops.wildcap.add_face_units()
    settings, root = item.deliver, captures.root(item)
    settings.what, settings.preset, settings.format = options.what, options.preset, options.format
    settings.folder = str(options.to or "")
    with contextlib.suppress(RuntimeError):  # a refusal is in problems.of
        bpy.ops.wildcap.deliver('EXEC_DEFAULT')
    while jobs.poll():
        time.sleep(POLL_S)
    if waiting.ready(root) is not None:  # without a window the mesh is added here
        return [waiting.finish(bpy.context, item)]
    problem = problems.of(root)
    if problem is not None and not isinstance(problem, problems.Notice):
        raise problem
    return [waiting.last(root)]


def _add_options(parser) -> None:
    parser.add_argument("capture", type=Path)
    parser.add_argument("--preset", choices=tuple(delivery_presets.PRESETS), default="blender")
    parser.add_argument("--format", choices=("preset", *delivery_presets.FORMATS), default="preset")
    parser.add_argument("--what", choices=tuple(delivery_presets.WHAT), default="head")
    parser.add_argument("--to", type=Path, metavar="FOLDER", help="where to; default: exports in the capture")


COMMANDS = (Command("deliver", "the head with its maps as another program wants them", _add_options, _deliver),)
