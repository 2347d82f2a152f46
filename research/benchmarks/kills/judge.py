# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What has to hold of a capture after a kill, and after the run that goes on from it. Each fault is a sentence; no
sentence, no fault."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from pathlib import Path

from core.capture import ownership, stages
from core.capture.hashes import read_hash
from core.capture.messages import Problem

from ..same_maps import written
from .capture import BESIDE, STRANGERS, Undisturbed, capture_at
from .worker import in_fork, running_at

TOLD = ("capture.json", "job.json", "report.html", "consent.json")
"""They hold times: what is asked of them is to be whole."""


PASSING = ("preview/", "checkpoints/")
"""What they hold in the middle of a stage no other run need have had: it has to be readable."""


def judge_kill(
    place: Path,
    known_contents: Mapping[str, Collection[str]],
    masks: Mapping[str, Collection[bytes]] | None = None,
    within: Collection[str] = (),
) -> list[str]:
    """Find the faults of a place in which something was killed.

    known_contents: name in the capture -> hashes of the complete contents that it may have; masks: name -> contents
    that a mask may have which was being painted; within: folders in which files are new in every run, of which only
    the user's are judged."""
    root = capture_at(place).root
    found = find_lost(place, aside=True)
    for name, contents in (masks or {}).items():
        if not (root / name).is_file() or (root / name).read_bytes() not in contents:
            found.append(f"{name} is neither the old mask nor a new one")
    for path, name in _named(root):
        kept = name in (*STRANGERS, *(masks or {}), ownership.RECORD, "lock")
        if kept or name.startswith(("lock.", "logs/", "mask_history/", *within)):
            continue
        if name in TOLD:
            fault = _told(path)
        elif name.startswith(PASSING):
            fault = _read(path)
        else:
            fault = "" if read_hash(path) in known_contents.get(name, ()) else "is no complete content of any run"
        found += [f"{name} {fault}"] if fault else []
    return found


def judge_resume(
    place: Path,
    undisturbed: Undisturbed,
    last: str,
    masks: Mapping[str, Collection[bytes]] | None = None,
    unlike: Collection[str] = (),
    within: Collection[str] = (),
) -> list[str]:
    """Find the faults of a place in which the run that goes on has ended: every stage has the undisturbed run's bytes,
    all of the user's is in its place, and nothing else is left.

    undisturbed: the run that it is compared with; last: the last stage that was run; unlike: stages whose bytes
    differ from run to run."""
    capture, expected = capture_at(place), undisturbed.end
    found = judge_kill(place, undisturbed.known, masks, within) + find_lost(place) + _left(place)
    for stage in stages.STAGES[: stages.NAMES.index(last) + 1]:
        if stage.name in unlike:
            continue
        ours, theirs = written(capture, stage), written(expected, stage)
        found += [
            f"{name} is not as in the undisturbed run"
            for name in sorted(ours.keys() | theirs.keys())
            if ours.get(name) != theirs.get(name)
        ]
        if stage.name not in capture.read()["stages"]:
            found.append(f"the stage {stage.name} is not on record")
    return found


def tree(folder: Path) -> dict[str, str]:
    """Every file below a folder: name -> content hash."""
    return {
        path.relative_to(folder).as_posix(): read_hash(path) for path in sorted(folder.rglob("*")) if path.is_file()
    }


def find_lost(place: Path, aside: bool = False) -> list[str]:
    """The user's files that are gone or changed. `aside`: one may lie in the folder that was just being put aside for a
    new one (.NAME.old)."""
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
    """What should have gone with the run: temporary files, locks, processes, what was kept aside though nobody had
    changed it, and files elsewhere."""
    capture = capture_at(place)
    found = [
        f"{path.relative_to(place)} is left"
        for path in sorted(place.rglob(".*"))
        if path.relative_to(capture.root.parent).as_posix() not in {f"{capture.root.name}/{name}" for name in STRANGERS}
        and ".look" not in path.parts
    ]
    found += [f"{path.name} is left" for path in capture.root.glob("lock*")]
    found += [
        f"{name} was kept aside, and nobody had changed it" for name in sorted(ownership.kept_files(capture.root))
    ]
    found += [
        f"{path.name} lies beside the capture"
        for path in sorted(place.iterdir())
        if path.name not in (BESIDE, capture.root.name, "out")
    ]
    found += [f"process {pid} still runs there" for pid in running_at(place)]
    try:
        capture.check_free()
    except Problem as problem:
        found.append(f"the lock is not free: {problem}")
    return found


def _named(root: Path) -> list[tuple[Path, str]]:
    """The files under final names: no part of those begins with a dot."""
    files = ((path, path.relative_to(root)) for path in sorted(root.rglob("*")) if path.is_file())
    return [
        (path, inside.as_posix()) for path, inside in files if not any(part.startswith(".") for part in inside.parts)
    ]


def _read(path: Path) -> str:
    """What is wrong with a picture or a checkpoint; '' for nothing."""
    return in_fork(lambda: _try_reading(path))


def _try_reading(path: Path) -> str:
    from safetensors import SafetensorError
    from safetensors.numpy import load_file

    from core.imaging import images

    try:
        load_file(path) if path.suffix == ".safetensors" else images.read_srgb(path)
    except (OSError, SafetensorError, Problem) as error:
        return f"cannot be read ({error})"
    return ""


def _told(path: Path) -> str:
    """What is wrong with a record or the report; '' for nothing."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".html":
        return "" if text.rstrip().endswith("</html>") else "is cut off"
    try:
        json.loads(text)
    except ValueError as error:
        return f"is no JSON ({error})"
    return ""
