# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Record of a batch of the listed captures, which stay in their folders, with the panels' settings."""

import itertools
import time
from pathlib import Path

from ...core.batch.record import GATES, Batch, BatchFace, read_batch, write_batch
from ...core.capture.files import storage_problem
from ...core.capture.json_files import plain_name
from ...core.capture.messages import Problem
from .. import batches, captures, preferences, properties

FOLDER = "batches"
"""Folder of batches among the captures; each has a folder named by the time."""


def prepare(context) -> tuple[Batch, list[str]]:
    """Return the batch of all faces, and the names of captures that it leaves out for lack of a video.

    It is the open batch if that was planned from a table. Otherwise it has the scene's list, and replaces the record of
    the open batch if that has the same captures. Raises Problem if no capture has a video.
    """
    open_batch = read_batch(batches.current()) if batches.current() is not None else None
    # captures in the batch's own folder: it was planned from a table, which decides on faces and settings
    if open_batch is not None and any(face.root.parent == open_batch.root for face in open_batch.faces):
        return open_batch, []
    faces, left_out = _list_faces(context)
    if not faces:
        raise Problem(
            "No capture of the list has a video or photographs that it could be made from.",
            "Choose videos: each becomes a capture of the list.",
        )
    same = open_batch is not None and {face.root for face in open_batch.faces} == {face.root for face in faces}
    root = open_batch.root if same else _make_folder(preferences.captures_folder() / FOLDER)
    batch = Batch(root, tuple(faces), gate=GATES[1])
    write_batch(batch)
    batches.choose(batch.root)
    return batch, left_out


def _list_faces(context) -> tuple[list[BatchFace], list[str]]:
    faces, left_out, names = [], [], set()
    for item in context.scene.wildcap.captures:
        capture = captures.folder(item)
        try:
            source = capture.source
        except Problem:
            source = None
        if source is None:
            left_out.append(item.name)
        else:
            name = _unique_name(capture.root.stem, names)
            faces.append(BatchFace(name, source, capture.root, item.quality, properties.job_settings(item)))
    return faces, left_out


def _unique_name(base: str, names: set[str]) -> str:
    """Return a face's name that is not among `names`, and add it: two captures in two folders may have the same."""
    base = base.lstrip("-")  # on a command line a hyphen would begin an option
    base = base if plain_name(base) else "face"
    candidates = (base if number == 1 else f"{base}_{number}" for number in itertools.count(1))
    name = next(name for name in candidates if name.casefold() not in names)
    names.add(name.casefold())
    return name


def _make_folder(parent: Path) -> Path:
    """Make a new folder, and return it. Raises Problem if it cannot."""
    stamp = time.strftime("%Y-%m-%d_%H-%M-%S")
    for number in itertools.count(1):
        folder = parent / (stamp if number == 1 else f"{stamp}_{number}")
        try:
            folder.mkdir(parents=True)
            return folder
        except FileExistsError:
            continue
        except OSError as error:
            raise storage_problem(error, folder) from error
    raise AssertionError
