# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keep what a solve begins with, of many captures, as one version of the code made it: so that a new solver is judged
on the old delighter's textures.

    python -m research.benchmarks.freeze FOLDER OUT [--only PREFIX ...]     keeps NAME.wildcap of FOLDER as
    OUT/NAME.wildcap
    python -m research.benchmarks.freeze --check OUT                        whether all is as it was kept

Kept are the frames, cameras, head, delit frames, textures and masks, and the solved maps for comparison;
OUT/frozen.json has each file's hash, and of each stage the version and the code's key. OUT lies outside of the
repository. What was kept is never replaced: a capture that has changed since is named, and ends the run with code 1.
Solve a copy of it; research/benchmarks/delighting/state.py measures OUT as it is, with --truths FOLDER.
"""

import json
import shutil
import sys
from pathlib import Path

from core.capture.capture import Capture
from core.capture.files import replacing_folder, write_json
from core.capture.hashes import read_hash
from core.capture.messages import Problem

from .figures import ROOT, command_line, commit

RECORD = "frozen.json"
FILES = (
    "capture.json",
    "head.obj",
    "texture.exr",
    "texture_filmed.png",
    "texture_confidence.exr",
    "texture_detail.exr",
    "shadow_mask_auto.png",
    "shadow_mask.png",
    "maps/diffuse_albedo.png",
    "maps/confidence.png",
)
FOLDERS = ("frames", "cameras", "delit")
STAGES = ("delight", "texture", "shadow_mask", "solve")
STAGE_KEYS = ("version", "code", "finished", "seed", "settings")


def main() -> int:
    parser = command_line(__doc__)
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", nargs="+", default=[""], help="captures whose names begin so")
    parser.add_argument("--check", action="store_true", help="compare OUT with its record instead")
    options = parser.parse_args()
    out = options.out.resolve()
    try:
        if options.check:
            wrong = differences(out)
            print("\n".join(wrong) or f"{len(read_record(out))} captures are as they were kept.")
        elif options.folder is None:
            parser.error("Name the folder of captures and the one to keep them in.")
        else:
            wrong = freeze(options.folder.resolve(), out, tuple(options.only))
    except Problem as problem:
        print(problem, file=sys.stderr)
        return 1
    return 1 if wrong else 0


def freeze(folder: Path, out: Path, only: tuple[str, ...] = ("",)) -> list[str]:
    """Keep the captures of a folder that have a texture; the names of those that were kept before and have changed
    since.

    Raises Problem where `out` lies in the repository, or nothing is there to keep.
    """
    if out.is_relative_to(ROOT):
        raise Problem(f"{out} lies in the repository.", "Name a folder outside of it.")
    captures = [
        path
        for path in sorted(folder.glob("*.wildcap"))
        if path.stem.startswith(only) and (path / "texture.exr").is_file()
    ]
    if not captures:
        raise Problem(f"{folder} holds no capture with a texture.", "Run the chain until texture first.")
    record, changed = read_record(out), []
    for source in captures:
        name, hashes = source.stem, {path: read_hash(source / path) for path in inputs(source)}
        if name in record:
            if record[name]["files"] != hashes:
                changed.append(name)
                print(f"{name} has changed since it was kept, and stays as it was kept.", file=sys.stderr)
            continue
        with replacing_folder(out / source.name) as kept:
            for path in hashes:
                (kept / path).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source / path, kept / path)
        stages = Capture(source).read()["stages"]
        record[name] = {
            "commit": commit(),
            "stages": {stage: {key: stages[stage][key] for key in STAGE_KEYS} for stage in STAGES if stage in stages},
            "files": hashes,
        }
        write_json(out / RECORD, record)
        print(f"{name}: {len(hashes)} files kept", flush=True)
    return changed


def differences(out: Path) -> list[str]:
    """Return what is not as the record of a folder has it, a line each."""
    found = []
    for name, kept in read_record(out).items():
        root = out / f"{name}.wildcap"
        there = {path: read_hash(root / path) for path in inputs(root)}
        found += [
            f"{name}: {path} "
            f"{'is missing' if path not in there else 'was added' if path not in kept['files'] else 'has changed'}."
            for path in sorted(there.keys() | kept["files"].keys())
            if there.get(path) != kept["files"].get(path)
        ]
    return found


def inputs(root: Path) -> list[str]:
    """Return the files of a capture that are kept, relative to it."""
    inside = [
        path
        for folder in FOLDERS
        for path in sorted((root / folder).rglob("*"))
        if path.is_file() and not path.name.startswith(".")
    ]
    return [name for name in FILES if (root / name).is_file()] + [path.relative_to(root).as_posix() for path in inside]


def read_record(out: Path) -> dict[str, dict]:
    """Capture -> {commit: HEAD when it was kept, stages, files: hash of each}; empty where nothing was kept yet."""
    path = out / RECORD
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


if __name__ == "__main__":
    sys.exit(main())
