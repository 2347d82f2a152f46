# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the farm of research/benchmarks/farm.py works on, and what is made of it afterwards: the films, the two batches,
equal bytes, and the account of every stage."""

from __future__ import annotations

import collections
import json
import shutil
import subprocess
import sys
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av

from core.batch.ray_task import LOGS
from core.capture import stages
from core.capture.capture import Capture
from core.capture.files import replacing, replacing_folder

from . import same_maps
from .films import read_film

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "research" / "people" / "sample" / "capture.mp4"
FRAMES = 12
KINDS = 4
"""How many different captures there are: each is another cut of the sample video with another seed."""
SETTINGS = {
    "device": "cpu",
    "frames": {"max_frames": FRAMES, "long_side": 320, "views": 3},
    "scan": {"pairs": 3, "voxel_mm": 5.0},
    "registration": {"iterations": 2},
    "delight": {"delighter": "shading"},
    "texture": {"size": 256},
    "solve": {"size": 128, "steps": 4, "guidance": "proximal", "grid_cells": 4},
    "upscale": {"size": 1024, "method": "lanczos", "frames_detail": False},
    "transfer": {"size": 256, "scan_size": 256, "scan_detail_mm": 10.0},
}
"""As little work as every stage takes."""


@dataclass(frozen=True)
class Begun:
    """A stage as a node's account has it; `finished` is when it ended, None where it did not. Seconds of the clock that
    all nodes share."""

    host: str
    pid: int
    face: str
    stage: str
    at: float
    finished: float | None


def lay_out(folder: Path, count: int) -> None:
    """FOLDER/code with WildCap as it is now, FOLDER/films, and FOLDER/serial with each kind once and FOLDER/farm with
    `count` faces, planned; made again, it leaves what is there, the code among it: a trial of hours is one of one
    version."""
    if not code(folder).is_dir():
        with replacing_folder(code(folder)) as copied:
            shutil.copytree(ROOT / "core", copied / "core", ignore=shutil.ignore_patterns("__pycache__"))
    films = folder / "films"
    films.mkdir(parents=True, exist_ok=True)
    for kind in range(KINDS):
        if not film(folder, kind).is_file():
            _cut(film(folder, kind), kind)
        with replacing(films / f"{kind}.json") as temporary:
            temporary.write_text(json.dumps({**SETTINGS, "seed": kind}), encoding="utf-8")
    for batch, names in (("serial", twin_names()), ("farm", face_names(count))):
        rows = [
            f"{film(folder, number % KINDS).name},{name},{number % KINDS}.json" for number, name in enumerate(names)
        ]
        (films / f"{batch}.csv").write_text("\n".join(["video,name,settings", *rows]) + "\n", encoding="utf-8")
        subprocess.run(
            [*core(), "plan", str(films / f"{batch}.csv"), str(folder / batch)],
            check=True,
            stdout=subprocess.DEVNULL,
            cwd=code(folder),
        )


def code(folder: Path) -> Path:
    """Where the commands of `core` are run."""
    return folder / "code"


def core() -> list[str]:
    return [sys.executable, "-B", "-m", "core", "batch"]


def film(folder: Path, kind: int) -> Path:
    return folder / "films" / f"{kind}.mp4"


def twin_names() -> list[str]:
    return [f"kind{number}" for number in range(KINDS)]


def face_names(count: int) -> list[str]:
    return [f"face{number:03}" for number in range(count)]


def _cut(path: Path, kind: int) -> None:
    """Every fifth picture of the sample, beginning with another one for each kind."""
    pictures = list(read_film(SAMPLE))
    step = len(pictures) // FRAMES
    with replacing(path) as temporary, av.open(str(temporary), "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(24))
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt, stream.options = "yuv420p", {"crf": "12", "preset": "veryfast", "threads": "1"}
        for picture in pictures[kind::step][:FRAMES]:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())


def unequal(folder: Path, count: int) -> list[str]:
    """The files of the farm's captures that are not the bytes of their twins', as FACE/FILE; a capture that is not
    finished misses some."""
    twins, found = {}, []
    for number, name in enumerate(face_names(count)):
        twin = twin_names()[number % KINDS]
        if twin not in twins:
            twins[twin] = _written(folder / "serial" / f"{twin}.wildcap")
        made = _written(folder / "farm" / f"{name}.wildcap")
        found += [
            f"{name}/{file}"
            for file in sorted(made.keys() | twins[twin].keys())
            if made.get(file) != twins[twin].get(file)
        ]
    return found


def _written(root: Path) -> dict[str, str]:
    return {
        name: content for stage in stages.STAGES for name, content in same_maps.written(Capture(root), stage).items()
    }


def count_files(folder: Path) -> int:
    return len(_written(folder / "serial" / f"{twin_names()[0]}.wildcap"))


def read_account(folder: Path) -> list[Begun]:
    """What the nodes say that they began. A line that a machine was killed over counts as not written."""
    found: list[Begun] = []
    for path in sorted((folder / "farm" / LOGS).glob("*.jsonl")):
        begun: dict[tuple, dict] = {}
        for text in path.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                line = json.loads(text)
            except ValueError:
                continue
            key = line["pid"], line["face"], line["stage"]
            if line["finished"]:
                first = begun.pop(key, line)
                found.append(Begun(path.stem, *key, first["at"], line["at"]))
            else:
                if key in begun:
                    found.append(Begun(path.stem, *key, begun[key]["at"], None))
                begun[key] = line
        found += [Begun(path.stem, *key, line["at"], None) for key, line in begun.items()]
    return sorted(found, key=lambda each: each.at)


def judge_account(account: list[Begun], kills: list[dict]) -> dict:
    """{"stages": runs that were finished, "twice": stages of a face that were finished again, "interrupted": runs that
    were begun and not finished, "unexplained": those of them that no kill of their process, or of their node,
    explains}. A kill is {"at", "host", "pid"}, with None for all of them."""
    done = collections.Counter((each.face, each.stage) for each in account if each.finished is not None)
    broken = [each for each in account if each.finished is None]

    def explained(each: Begun) -> bool:
        return any(
            kill["at"] >= each.at and kill["host"] in (None, each.host) and kill["pid"] in (None, each.pid)
            for kill in kills
        )

    return {
        "stages": sum(done.values()),
        "twice": sum(count - 1 for count in done.values()),
        "interrupted": len(broken),
        "unexplained": sum(not explained(each) for each in broken),
    }
