# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample head: a finished capture that is shipped, copied to where the artist may write, and shown; needs no solver."""

import shutil
from pathlib import Path

import bpy

from ...core.contract import ownership
from ...core.contract.capture import Capture
from ...core.contract.files import replacing_folder, storage_problem, write_json
from ...core.contract.messages import Problem
from .. import captures, preferences, status
from ..base_operator import BaseOperator

SHIPPED = Path(__file__).resolve().parents[2] / "core" / "assets" / "sample_head"
VERTICES = "head_vertices.obj"
"""In place of head.obj: where its vertices are. The rest of it is the built-in head's."""


class WILDCAP_OT_open_sample_head(BaseOperator, bpy.types.Operator):
    """Copy the finished sample head to your captures and show it; needs no solver"""

    bl_idname = "wildcap.open_sample_head"
    bl_label = "Open Sample Head"
    bl_options = {'REGISTER', 'UNDO'}

    def work(self, context):
        capture = copy_to(preferences.captures_folder())
        captures.add(context, capture.root)
        if context.mode != 'OBJECT':
            bpy.ops.object.mode_set(mode='OBJECT')
        bpy.ops.wildcap.bring_in_head()
        if all(path.is_file() for path in status.delivered(capture)):  # an artist's copy of it may be on its way to other maps
            bpy.ops.wildcap.assemble_material()


def copy_to(folder: Path) -> Capture:
    """A writable copy of the sample head in `folder`; one that is there already is kept with the artist's work in it."""
    if not (SHIPPED / VERTICES).is_file():
        raise Problem("The sample head is missing from this installation.", "Install the extension's zip again.")
    capture = Capture(folder / "sample_head.wildcap")
    if not capture.head.is_file():
        capture.refuse_strangers()
        try:
            with replacing_folder(capture.root) as temporary:
                shutil.copytree(SHIPPED, temporary, dirs_exist_ok=True, copy_function=shutil.copyfile)
                moved = (temporary / VERTICES).read_text(encoding="ascii")
                built_in = (SHIPPED.parent / "head.obj").read_text(encoding="ascii").splitlines(keepends=True)
                (temporary / capture.head.name).write_text(moved + "".join(line for line in built_in if not line.startswith("v ")), encoding="ascii")
                (temporary / VERTICES).unlink()
                write_json(temporary / capture.json.name, capture.read())
                ownership.claim_all(temporary)
        except shutil.Error as error:  # a list of (source, target, reason)
            raise storage_problem(OSError(0, str(error.args[0][0][2])), capture.root) from error
    elif not capture.json.is_file():  # by WildCap 0.1.0
        ownership.adopt_first_format(capture.root)
        write_json(capture.json, capture.read())
    return capture


CLASSES = (WILDCAP_OT_open_sample_head,)
