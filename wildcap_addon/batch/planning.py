# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The record of a batch of the captures that the scene lists, which stay where they are, with their settings as the
panels have them."""

import itertools
import time
from pathlib import Path

from ...core.batch.record import GATES, Batch, BatchFace, read_batch, write_batch
from ...core.capture.files import storage_problem
from ...core.capture.json_files import plain_name
from ...core.capture.messages import Problem
from .. import batches, captures, preferences, properties

FOLDER = "batches"
"""Where they lie, among the captures: a folder for each, named by the time."""


def prepare(context) -> tuple[Batch, list[str]]:
    """The batch that is meant by "all", and the names of captures that it leaves out because there is no video to begin
    with. Raises Problem.

    The open one, as it is, if it was planned from a table. Else one of the scene's list: the open one anew where it has
    these very captures, or another.
    """
    opened = read_batch(batches.current()) if batches.current() is not None else None
    if opened is not None and is_planned(opened):
        return opened, []
    faces, left_out = _list_faces(context)
    if not faces:
        raise Problem(
            "No capture of the list has a video or photographs that it could be made from.",
            "Choose videos: each becomes a capture of the list.",
        )
    same = opened is not None and {face.root for face in opened.faces} == {face.root for face in faces}
    batch = Batch(
        opened.root if same else _make_folder(preferences.captures_folder() / FOLDER), tuple(faces), gate=GATES[1]
    )
    write_batch(batch)
    batches.choose(batch.root)
    return batch, left_out


def is_planned(batch: Batch) -> bool:
    """Whether a table says who is in it, and by which settings: such a batch has captures in its own folder."""
    return any(face.root.parent == batch.root for face in batch.faces)


def _list_faces(context) -> tuple[list[BatchFace], list[str]]:
    faces, left_out, taken = [], [], set()
    for item in context.scene.wildcap.captures:
        capture = captures.folder(item)
        try:
            source = capture.source
        except Problem:
            source = None
        if source is None:
            left_out.append(item.name)
        else:
            faces.append(
                BatchFace(
                    _name(capture.root.stem, taken), source, capture.root, item.quality, properties.job_settings(item)
                )
            )
    return faces, left_out


def _name(base: str, taken: set[str]) -> str:
    """A name of its own for a face; two captures in two folders may have the same."""
    # on a command line a hyphen would begin an option
    base = base.lstrip("-") if plain_name(base.lstrip("-")) else "face"
    name = next(
        name
        for number in itertools.count(1)
        if (name := base if number == 1 else f"{base}_{number}").casefold() not in taken
    )
    taken.add(name.casefold())
    return name


def _make_folder(parent: Path) -> Path:
    """A new folder, never one that is there. Raises Problem where none can be made."""
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
