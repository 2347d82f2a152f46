# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A face is deleted: first a list of all that would go and all that stays, then exactly that.

What goes is what WildCap wrote and nobody changed (ownership.py), the capture's own books, its logs and what killed
stages left. The video and deliveries elsewhere are never touched. Standard library only.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from . import ownership, stages, unforeseen
from .capture import Capture
from .delivery_plan import PROVENANCE, is_as_delivered, read_delivered
from .files import storage_problem
from .messages import Problem

LOGS = frozenset(
    {
        "logs/worker.log",
        "logs/contact_sheet.log",
        f"logs/{unforeseen.LOG}",
        *(f"logs/{stage.name}.log" for stage in (*stages.STAGES, *stages.TOOLS)),
    }
)
GROUPS = {
    "frames": "Frames",
    "cameras": "Cameras",
    "scan.ply": "Scan",
    "head.obj": "Head",
    "own_head.obj": "Head",
    "own_head.json": "Head",
    "landmarks.json": "Landmarks",
    "landmarks_artist.json": "Landmarks",
    "delit": "Delit frames",
    "switchlight": "SwitchLight's answers",
    "shadow_mask.png": "Painted masks",
    "protect_mask.png": "Painted masks",
    "mask_history": "Painted masks",
    "maps": "Maps",
    "maps_4k": "Maps",
    "renders": "Renders",
    "delivery": "Exports",
    "exports": "Exports",
    "logs": "Logs",
    "report": "Report",
    "report.html": "Report",
}
"""What the first part of a file's path in the capture is called in the list."""
REST = "Other working files"
FOLDERS = tuple(
    f"{name}/-" for name in (*GROUPS, "checkpoints", "comparison", "preview", ownership.KEPT) if "." not in name
)
"""Our own folders, which go where they are empty, as a file in each."""


@dataclass(frozen=True)
class FileGroup:
    """Files of one kind that go: how many, and their size together."""

    label: str
    files: int
    size: int


@dataclass(frozen=True)
class Deletion:
    """What deleting a capture does: the files that go (paths in the capture), also by kind; and the files that stay."""

    going: tuple[str, ...]
    groups: tuple[FileGroup, ...]
    staying: tuple[str, ...]

    @property
    def size(self) -> int:
        return sum(group.size for group in self.groups)


def plan(capture: Capture) -> Deletion:
    """Looks at every file of a capture. Raises Problem where it is none, or cannot be read."""
    _require(capture)
    going: dict[str, int] = {}
    staying = []
    try:
        for path in ownership.files_in(capture.root):
            inside = ownership.path_inside(capture.root, path)
            if _is_ours(capture, path, inside):
                going[inside] = path.lstat().st_size
            else:
                staying.append(inside)
    except OSError as error:
        raise storage_problem(error, capture.root) from error
    kinds: dict[str, list[int]] = {}
    for inside, size in going.items():
        kinds.setdefault(GROUPS.get(inside.partition("/")[0], REST), []).append(size)
    groups = sorted(
        (FileGroup(label, len(sizes), sum(sizes)) for label, sizes in kinds.items()), key=lambda group: -group.size
    )
    return Deletion(tuple(going), tuple(groups), tuple(staying))


def delete(capture: Capture) -> Deletion:
    """Deletes what is WildCap's, looking at each file once more, and returns what went and what stayed. Killed in the
    middle, it can be asked for again: the books go last. Raises Problem where a worker is at the capture, or a file
    cannot be deleted."""
    _require(capture)
    with capture.locked():
        deletion = plan(capture)
        try:
            # which says whose the others are
            for inside in sorted(deletion.going, key=lambda inside: PurePosixPath(inside).name == PROVENANCE):
                if inside not in ownership.BOOKS:
                    (capture.root / inside).unlink(missing_ok=True)
            for folder in sorted(
                {folder for inside in (*deletion.going, *FOLDERS) for folder in _folders(inside)}, reverse=True
            ):
                with contextlib.suppress(OSError):  # it is not there, or somebody's files are in it
                    (capture.root / folder).rmdir()
            # last what tells that the folder is a capture, and whose its files are
            for name in (capture.job.name, capture.json.name, ownership.RECORD):
                (capture.root / name).unlink(missing_ok=True)
        except OSError as error:
            raise storage_problem(error, capture.root) from error
    with contextlib.suppress(OSError):  # somebody's files are in it
        capture.root.rmdir()
    return deletion


def _is_ours(capture: Capture, path: Path, inside: str) -> bool:
    if path.is_symlink():
        return inside in ownership.BOOKS
    if path.is_relative_to(capture.exports) and len(path.relative_to(capture.exports).parts) > 1:
        target = capture.exports / path.relative_to(capture.exports).parts[0]
        digest = (read_delivered(target) or {}).get(path.relative_to(target).as_posix())
        return digest is not None and is_as_delivered(path, digest)
    return inside in LOGS or ownership.is_ours(capture.root, path) or ownership.is_leftover(capture.root, path)


def _folders(inside: str) -> list[str]:
    """The folders of the capture that a file lies in."""
    return [parent.as_posix() for parent in PurePosixPath(inside).parents if parent.name]


def _require(capture: Capture) -> None:
    if not capture.json.is_file() and not (capture.root / ownership.RECORD).is_file():
        raise Problem(
            f"There is no capture at {capture.root}.", "Check the name: a capture's folder holds capture.json."
        )


def lines(deletion: Deletion, translated=lambda text: text) -> list[str]:
    """The list as sentences; `translated` gives a sentence in the reader's language."""
    words = translated("{} files of this face are deleted for good, {} in all:")
    said = [words.format(len(deletion.going), megabytes(deletion.size))]
    said += [
        translated("{}: {} files, {}").format(translated(group.label), group.files, megabytes(group.size))
        for group in deletion.groups
    ]
    if deletion.staying:
        more = (
            translated(" and {} more").format(len(deletion.staying) - SHOWN_FILES)
            if len(deletion.staying) > SHOWN_FILES
            else ""
        )
        said.append(
            translated("{} files stay, which WildCap did not write or somebody changed: {}").format(
                len(deletion.staying), ", ".join(deletion.staying[:SHOWN_FILES]) + more
            )
        )
    return [*said, translated("The video and what was delivered elsewhere stay.")]


SHOWN_FILES = 5
"""Files that stay and are named; the others are counted."""


def megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"
