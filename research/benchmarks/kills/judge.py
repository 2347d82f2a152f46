# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of a capture after a kill, and after the run that goes on from it: a sentence for each fault."""

import json
from collections.abc import Collection, Mapping
from pathlib import Path

from core.capture import ownership, stages
from core.capture.hashes import read_hash
from core.capture.messages import Problem

from ..same_maps import written
from .capture import BESIDE, STRANGERS, Undisturbed, capture_at
from .worker import in_fork, running_at

Masks = Mapping[str, Collection[bytes]]
"""Name -> contents that a mask may have while it is being painted."""
TIMED = ("capture.json", "job.json", "report.html", "consent.json")
"""Files that hold times: they only have to be whole."""
PASSING = ("preview/", "checkpoints/")
"""Files from the middle of a stage: they only have to be readable."""


def judge_kill(
    place: Path, known: Mapping[str, Collection[str]], masks: Masks | None = None, unlike: tuple[str, ...] = ()
) -> list[str]:
    """Find the faults of a place in which something was killed.

    known: name in the capture -> hashes of its complete contents; unlike: beginnings of names that are new in every
    run, of which only the user's are judged.
    """
    root, masks = capture_at(place).root, masks or {}
    found = find_lost(place, aside=True)
    for name, contents in masks.items():
        if not (root / name).is_file() or (root / name).read_bytes() not in contents:
            found.append(f"{name} is neither the old mask nor a new one")
    for name, path in _final_files(root).items():
        if name in (*STRANGERS, *masks, ownership.RECORD, "lock"):
            continue
        if name.startswith(("lock.", "logs/", "mask_history/", *unlike)):
            continue
        if name in TIMED:
            fault = _not_whole(path)
        elif name.startswith(PASSING):
            fault = in_fork(lambda path=path: _not_readable(path))
        else:
            fault = "" if read_hash(path) in known.get(name, ()) else "is no complete content of any run"
        found += [f"{name} {fault}"] if fault else []
    return found


def judge_resume(
    place: Path,
    undisturbed: Undisturbed,
    last: str,
    masks: Masks | None = None,
    unlike: tuple[str, ...] = (),
    unlike_stages: tuple[str, ...] = (),
) -> list[str]:
    """Find the faults of a place in which the run that goes on has ended with the stage `last`.

    Every stage but `unlike_stages` must have the undisturbed run's bytes, and nothing else may be left.
    """
    capture = capture_at(place)
    found = judge_kill(place, undisturbed.known, masks, unlike) + find_lost(place) + _left(place)
    for stage in stages.STAGES[: stages.NAMES.index(last) + 1]:
        if stage.name in unlike_stages:
            continue
        ours, theirs = written(capture, stage), written(undisturbed.end, stage)
        differing = sorted(name for name in ours.keys() | theirs.keys() if ours.get(name) != theirs.get(name))
        found += [f"{name} is not as in the undisturbed run" for name in differing]
        if stage.name not in capture.read()["stages"]:
            found.append(f"the stage {stage.name} is not on record")
    return found


def tree(folder: Path) -> dict[str, str]:
    """Return every file below a folder: name -> content hash."""
    return {
        path.relative_to(folder).as_posix(): read_hash(path) for path in sorted(folder.rglob("*")) if path.is_file()
    }


def find_lost(place: Path, aside: bool = False) -> list[str]:
    """Find the user's files that are gone or changed; `aside`: one may lie in a folder just put aside (.NAME.old)."""
    root, found = capture_at(place).root, []
    for name, content in STRANGERS.items():
        first, _, rest = name.partition("/")
        places = [root / name, *([root / f".{first}.old" / rest] if aside and rest else [])]
        if not any(path.is_file() and path.read_bytes() == content for path in places):
            found.append(f"the user's {name} is {'changed' if places[0].is_file() else 'gone'}")
    if (place / BESIDE).read_bytes() != STRANGERS["shopping.txt"]:
        found.append("the user's file beside the capture is changed")
    return found


def _left(place: Path) -> list[str]:
    """Find what should have gone with the run: temporary files, locks, processes, files put aside or elsewhere."""
    capture = capture_at(place)
    users = {capture.root / name for name in STRANGERS}
    hidden = [path for path in sorted(place.rglob(".*")) if path not in users and ".look" not in path.parts]
    found = [f"{path.relative_to(place)} is left" for path in (*hidden, *capture.root.glob("lock*"))]
    found += [f"{name} was put aside, though nobody changed it" for name in sorted(ownership.kept_files(capture.root))]
    beside = {path.name for path in place.iterdir()} - {BESIDE, capture.root.name, "out"}
    found += [f"{name} lies beside the capture" for name in sorted(beside)]
    found += [f"process {pid} still runs there" for pid in running_at(place)]
    try:
        capture.check_free()
    except Problem as problem:
        found.append(f"the lock is not free: {problem}")
    return found


def _final_files(root: Path) -> dict[str, Path]:
    """Return the files under final names, no part of which begins with a dot."""
    names = {path.relative_to(root): path for path in sorted(root.rglob("*")) if path.is_file()}
    return {name.as_posix(): path for name, path in names.items() if not any(p.startswith(".") for p in name.parts)}


def _not_readable(path: Path) -> str:
    """Return the fault of a picture or a checkpoint, '' if it has none."""
    from safetensors import SafetensorError
    from safetensors.numpy import load_file

    from core.imaging import images

    try:
        load_file(path) if path.suffix == ".safetensors" else images.read_srgb(path)
    except (OSError, SafetensorError, Problem) as error:
        return f"cannot be read ({error})"
    return ""


def _not_whole(path: Path) -> str:
    """Return the fault of a record or the report, '' if it has none."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".html":
        return "" if text.rstrip().endswith("</html>") else "is cut off"
    try:
        json.loads(text)
    except ValueError as error:
        return f"is no JSON ({error})"
    return ""
