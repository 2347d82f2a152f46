# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delete a face: list all that would go and all that stays, then delete exactly that.

What goes: files that WildCap wrote and nobody changed (ownership.py), the capture's own records, its logs and the
leftovers of killed stages. The video and deliveries elsewhere are never touched.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from . import ownership, stages, unforeseen
from .capture import Capture
from .delivery_plan import PROVENANCE, is_as_delivered, read_delivered
from .files import storage_problems
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
    "maps_retouched": "Maps",
    "retouch": "Retouch layers",
    "renders": "Renders",
    "delivery": "Exports",
    "exports": "Exports",
    "logs": "Logs",
    "report": "Report",
    "report.html": "Report",
}
"""First part of a file's path in the capture -> its label in the list."""
REST = "Other working files"
FOLDERS = tuple(
    f"{name}/-" for name in (*GROUPS, "checkpoints", "comparison", "preview", ownership.KEPT) if "." not in name
)
"""A file in each of our folders, which go if they are empty."""
SHOWN_FILES = 5
"""Number of files that stay and are listed by name."""


@dataclass(frozen=True)
class FileGroup:
    """Files of one kind that go: their number and size together."""

    label: str
    files: int
    size: int


@dataclass(frozen=True)
class Deletion:
    """Files that go (paths in the capture), also by kind, and files that stay."""

    going: tuple[str, ...]
    groups: tuple[FileGroup, ...]
    staying: tuple[str, ...]

    @property
    def size(self) -> int:
        """Bytes that are freed."""
        return sum(group.size for group in self.groups)


def plan(capture: Capture) -> Deletion:
    """List the files of a capture. Raises Problem if it is none, or cannot be read."""
    _require(capture)
    going, staying = [], []
    kinds: dict[str, list[int]] = {}
    with storage_problems(capture.root):
        for path in ownership.files_in(capture.root):
            inside = ownership.path_inside(capture.root, path)
            if _is_ours(capture, path, inside):
                going.append(inside)
                kinds.setdefault(GROUPS.get(inside.partition("/")[0], REST), []).append(path.lstat().st_size)
            else:
                staying.append(inside)
    groups = [FileGroup(label, len(sizes), sum(sizes)) for label, sizes in kinds.items()]
    return Deletion(tuple(going), tuple(sorted(groups, key=lambda group: -group.size)), tuple(staying))


def delete(capture: Capture) -> Deletion:
    """Delete what is WildCap's, checking each file once more, and return what went and what stayed.

    It can be repeated after a kill, because the records go last. Raises Problem if a worker holds the capture, or a
    file cannot be deleted.
    """
    _require(capture)
    with capture.locked(), storage_problems(capture.root):
        deletion = plan(capture)
        # a delivery's provenance last: it tells whose the other files are
        for inside in sorted(deletion.going, key=lambda inside: PurePosixPath(inside).name == PROVENANCE):
            if inside not in ownership.BOOKS:
                (capture.root / inside).unlink(missing_ok=True)
        parents = (PurePosixPath(inside).parents for inside in (*deletion.going, *FOLDERS))
        folders = {folder.as_posix() for each in parents for folder in each if folder.name}
        for folder in sorted(folders, reverse=True):
            with contextlib.suppress(OSError):  # missing, or not empty
                (capture.root / folder).rmdir()
        for name in (capture.job.name, capture.json.name, ownership.RECORD):
            (capture.root / name).unlink(missing_ok=True)
    with contextlib.suppress(OSError):  # not empty
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


def _require(capture: Capture) -> None:
    if not capture.json.is_file() and not (capture.root / ownership.RECORD).is_file():
        raise Problem(
            f"There is no capture at {capture.root}.", "Check the name: a capture's folder contains capture.json."
        )


def lines(deletion: Deletion, translated=lambda text: text) -> list[str]:
    """Return the list as sentences; `translated` translates a template."""
    summary = translated("{} files of this face are deleted for good, {} in all:")
    sentences = [summary.format(len(deletion.going), megabytes(deletion.size))]
    sentences += [
        translated("{}: {} files, {}").format(translated(group.label), group.files, megabytes(group.size))
        for group in deletion.groups
    ]
    if deletion.staying:
        names, more = ", ".join(deletion.staying[:SHOWN_FILES]), len(deletion.staying) - SHOWN_FILES
        if more > 0:
            names += translated(" and {} more").format(more)
        staying = translated("{} files stay, which WildCap did not write or somebody changed: {}")
        sentences.append(staying.format(len(deletion.staying), names))
    return [*sentences, translated("The video and what was delivered elsewhere stay.")]


def megabytes(size: int) -> str:
    """Format a number of bytes."""
    return f"{size / 1e6:.1f} MB"
