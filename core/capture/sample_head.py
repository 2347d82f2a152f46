# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample head: a finished capture that ships with WildCap and is copied to be worked on."""

from __future__ import annotations

import shutil
from pathlib import Path

from . import ownership
from .capture import Capture
from .files import replacing_folder, write_json
from .messages import Problem

SHIPPED = Path(__file__).resolve().parents[1] / "assets" / "sample_head"
VERTICES = "head_vertices.obj"
"""The vertices of its head.obj; the rest is the built-in head's."""


def copy_to(folder: Path) -> Capture:
    """Copy the sample head into `folder`, unless it is there already with the artist's work.

    Raises Problem if it is missing from the installation, or cannot be written.
    """
    if not (SHIPPED / VERTICES).is_file():
        raise Problem("The sample head is missing from this installation.", "Install the extension's zip again.")
    capture = Capture(folder / "sample_head.wildcap")
    if not capture.head.is_file():
        capture.refuse_strangers()
        with replacing_folder(capture.root) as temporary:
            for path in ownership.files_in(SHIPPED):
                place = temporary / path.relative_to(SHIPPED)
                # shutil.copytree would copy the mode of a read-only extension
                place.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, place)
            vertices = (temporary / VERTICES).read_text(encoding="ascii")
            built_in = (SHIPPED.parent / "head.obj").read_text(encoding="ascii").splitlines(keepends=True)
            rest = "".join(line for line in built_in if not line.startswith("v "))
            (temporary / capture.head.name).write_text(vertices + rest, encoding="ascii")
            (temporary / VERTICES).unlink()
            write_json(temporary / capture.json.name, capture.read())
            ownership.claim_all(temporary)
    return capture
