# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The kinds of hostile cases: what is spoiled, and the command that reads it. run.py runs and judges them."""

from __future__ import annotations

import json
import os
import random
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from core.capture import stages
from core.capture.ownership import BOOKS

from ..kills.capture import DELIVERY, SAMPLE, Undisturbed, capture_at
from ..kills.worker import in_fork
from .mutations import VALUES, mutate

CHEAP = {"cameras": 6, "scan": 5, "texture": 2, "shadow_mask": 2}
"""Stages that take little time, and how often they are tried for once of the others."""
NAMES = (
    "Zoë et moi",
    "a b'c\"d",
    "-rf",
    "%s{0}$HOME`id`",
    "tab\there",
    "line\nbreak",
    ".hidden",
    "trailing. ",
    "CON",
    "x" * 240,
    "日本語の顔",
    "📷",
    "..wildcap",
    os.fsdecode(b"caf\xe9"),
    os.fsdecode(b"\xff\xfe"),
)


@dataclass
class Case:
    """A command line, what was spoiled (the path as it was given, and the names by which a refusal may call it), and
    what is new if it is accepted."""

    place: Path
    command: list[str] = field(default_factory=list)
    spoiled: Path | None = None
    named: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    said: str = ""
    content: bytes | None = None  # of the spoiled file, which has to be somewhere afterwards


@dataclass(frozen=True)
class Kind:
    """How a case of this kind is made out of a fresh copy of the finished capture, and how often."""

    make: Callable[[Case, Stock, random.Random], None]
    weight: int = 4


class Stock:
    """The undisturbed run, and files as users bring them: a film, photographs, a mask, landmarks, cameras, a mesh,
    delit pictures."""

    def __init__(self, undisturbed: Undisturbed, folder: Path):
        self.undisturbed, self.folder = undisturbed, folder
        folder.mkdir()
        end = undisturbed.end
        shutil.copy(SAMPLE / "capture.mp4", folder / "film.mp4")
        shutil.copytree(end.frames, folder / "photographs", ignore=shutil.ignore_patterns("*.json", "*.psd", ".*"))
        shutil.copytree(end.cameras, folder / "model", ignore=shutil.ignore_patterns("*.txt"))
        shutil.copy(SAMPLE / "cameras.json", folder / "cameras.json")
        points = {"152": [0.0, -0.1, -0.1], "1": [0.0, -0.13, -0.03]}
        (folder / "landmarks.json").write_text(json.dumps({"points": points}))
        (folder / "settings.json").write_text(json.dumps({"frames": {"views": 3}, "scan": {"pairs": 4}, "seed": 7}))
        if end.head.is_file():
            shutil.copy(end.head, folder / "mesh.obj")
        if end.delit.is_dir():
            shutil.copytree(end.delit, folder / "delit", ignore=shutil.ignore_patterns("look", "shadow", "*.json"))
        in_fork(lambda: _draw_masks(folder))

    def bring(self, name: str, case: Case) -> Path:
        """A copy of a file or folder of the stock, beside the case's capture."""
        place = case.place / "brought" / name
        place.parent.mkdir(exist_ok=True)
        (shutil.copytree if (self.folder / name).is_dir() else shutil.copy)(self.folder / name, place)
        return place


def kinds(names: tuple[str, ...]) -> dict[str, Kind]:
    """All that can be tried on a capture in which these stages were run."""
    found = {f"stage {name}": Kind(_of_stage(stages.by_name(name)), CHEAP.get(name, 1)) for name in names[1:]}
    found |= {
        "books": Kind(_book, 8),
        "video": Kind(_video),
        "photographs": Kind(_photographs),
        "mask": Kind(_mask, 6),
        "landmarks": Kind(_landmarks),
        "settings": Kind(_settings),
        "cameras": Kind(_cameras),
        "names": Kind(_names),
    }
    if "registration" in names:
        found["own mesh"] = Kind(_own_mesh, 1)
    if "delight" in names:
        found["delit pictures"] = Kind(_delit, 3)
    if "solve" in names:
        found["deliver"] = Kind(_deliver, 4)
    return found


def make_case(kind: Kind, place: Path, stock: Stock, rng: random.Random) -> Case:
    """Make a new case, its capture of hard links: nothing may be written into a file that is there."""
    shutil.copytree(stock.undisturbed.folder / "end", place, symlinks=True, copy_function=os.link)
    case = Case(place)
    kind.make(case, stock, rng)
    if case.spoiled is not None and case.spoiled.is_file() and not case.spoiled.is_symlink():
        case.content = case.spoiled.read_bytes()
    return case


def _spoil(case: Case, path: Path, rng: random.Random) -> None:
    # picture libraries start threads, which no process that forks may have
    way, said = in_fork(lambda: list(mutate(path, rng)))
    case.spoiled, case.said = path, f"{path.relative_to(case.place)}: {way}, {said}"
    case.named = (
        (path.name, path.parent.name)
        if path.parent.name in ("cameras", "model", "frames", "delit", "photographs")
        else (path.name,)
    )


def _run(case: Case, stage: str, source: str = "-", forced: bool = True, **settings: dict) -> None:
    """A run of one stage of the case's capture, with the settings of the undisturbed run and others."""
    job = json.loads(capture_at(case.place).job.read_text())["settings"] if capture_at(case.place).job.is_file() else {}
    chosen = case.place / "chosen.json"
    chosen.write_text(
        json.dumps({**job, **{name: {**job.get(name, {}), **values} for name, values in settings.items()}})
    )
    case.command = [
        "run",
        source,
        str(capture_at(case.place).root),
        "--settings",
        str(chosen),
        "--until",
        stage,
        *(["--from", stage] if forced else []),
    ]
    case.outputs = stages.by_name(stage).writes


def _of_stage(stage: stages.Stage) -> Callable:
    def make(case: Case, stock: Stock, rng: random.Random) -> None:
        root = capture_at(case.place).root
        names = (*stage.reads, *stage.optional_reads)
        files = [
            file
            for name in names
            for file in ([root / name] if (root / name).is_file() else sorted((root / name).glob("*.*")))
        ]
        ours = [
            file
            for file in files
            if file.name not in ("retouched.psd", "rig.txt") and not file.name.startswith(".") and file.is_file()
        ]
        _run(case, stage.name)
        _spoil(case, rng.choice(ours), rng)
        if stage.name == "cameras":
            case.named = (*case.named, "cameras.json")  # which the pictures no longer fit

    return make


def _book(case: Case, stock: Stock, rng: random.Random) -> None:
    capture = capture_at(case.place)
    name = rng.choice(["capture.json"] * 4 + ["job.json"] * 2 + ["written.jsonl", "lock", "frames/frames.json"])
    command = rng.choice(["status", "run", "run", "delete"])
    _run(case, "cameras", forced=False)
    if command != "run":
        case.command, case.outputs = [command, str(capture.root)], ()
    if name == "lock":
        (capture.root / name).write_text(json.dumps({"host": "elsewhere", "pid": 1, "began": 1.0, "token": "t"}))
    _spoil(case, capture.root / name, rng)
    case.named = (*case.named, "capture.json", str(capture.root), "This capture")  # which is what its books are about


def _video(case: Case, stock: Stock, rng: random.Random) -> None:
    film = stock.bring("film.mp4", case)
    shutil.rmtree(capture_at(case.place).root)
    _run(case, "frames", str(film), forced=False, frames={"max_frames": 8, "long_side": 320, "views": 3})
    _spoil(case, film, rng)


def _photographs(case: Case, stock: Stock, rng: random.Random) -> None:
    folder = stock.bring("photographs", case)
    shutil.rmtree(capture_at(case.place).root)
    _run(case, "frames", str(folder), forced=False, frames={"long_side": 320, "views": 3})
    _spoil(case, rng.choice(sorted(folder.iterdir())), rng)


def _mask(case: Case, stock: Stock, rng: random.Random) -> None:
    picture = stock.bring(rng.choice(["mask.png", "mask.exr", "mask.jpg"]), case)
    case.command = ["mask", "import", str(capture_at(case.place).root), str(picture)]
    case.outputs = ("shadow_mask.png",)
    _spoil(case, picture, rng)


def _landmarks(case: Case, stock: Stock, rng: random.Random) -> None:
    marks = stock.bring("landmarks.json", case)
    case.command = ["landmarks", "import", str(capture_at(case.place).root), str(marks)]
    case.outputs = ("landmarks_artist.json",)
    _spoil(case, marks, rng)


def _settings(case: Case, stock: Stock, rng: random.Random) -> None:
    root = str(capture_at(case.place).root)
    if rng.random() < 0.5:
        chosen = stock.bring("settings.json", case)
        case.command = ["run", "-", root, "--until", "frames", "--settings", str(chosen)]
        _spoil(case, chosen, rng)
        case.named = (chosen.name, "--settings", "frames.", "scan.", "seed")
    else:
        name = rng.choice(
            [
                "frames.views",
                "solve.skin_tone",
                "delight.delighter",
                "scan.voxel_mm",
                "none.such",
                "registration.template",
                "",
                "seed",
                "frames",
            ]
        )
        value = (
            rng.choice([*map(str, VALUES[3:-1]), "nan", "1e999", "0,0,0", "-5", "on"])
            .encode("utf-8", "replace")
            .decode()
            .replace("\0", "")
        )
        case.command = ["run", "-", root, "--until", "frames", f"--set={name}={value[:500]}"]
        case.said = f"--set {name}={value[:60]!r}"
        setting = name.rpartition(".")[2] or "--set"
        case.named = (name or "''", "--set", setting, setting.replace("_", " "))


def _cameras(case: Case, stock: Stock, rng: random.Random) -> None:
    brought = stock.bring(rng.choice(["model", "cameras.json"]), case)
    _run(case, "cameras", cameras={"import_from": str(brought)})
    _spoil(case, rng.choice(sorted(brought.iterdir())) if brought.is_dir() else brought, rng)
    case.named = (*case.named, brought.name)


def _own_mesh(case: Case, stock: Stock, rng: random.Random) -> None:
    mesh = stock.bring("mesh.obj", case)
    _run(case, "registration", registration={"template": str(mesh)})
    _spoil(case, mesh, rng)


def _delit(case: Case, stock: Stock, rng: random.Random) -> None:
    folder = stock.bring("delit", case)
    _run(case, "delight", delight={"delighter": "folder", "folder": str(folder)})
    _spoil(case, rng.choice(sorted(folder.iterdir())), rng)


def _deliver(case: Case, stock: Stock, rng: random.Random) -> None:
    capture = capture_at(case.place)
    files = [
        capture.head,
        *(
            path
            for folder in (capture.maps, capture.maps_4k)
            for path in sorted(folder.glob("*.*"))
            if path.suffix in (".png", ".exr")
        ),
    ]
    case.command = [
        "deliver",
        str(capture.root),
        "--to",
        str(case.place / "out"),
        "--set=deliver.format=obj",
        f"--set=deliver.preset={DELIVERY['preset']}",
        "--set=deliver.size=1024",
    ]
    _spoil(case, rng.choice(files), rng)


def _names(case: Case, stock: Stock, rng: random.Random) -> None:
    name, which = rng.choice(NAMES), rng.choice(["capture", "photographs", "photograph"])
    folder = stock.bring("photographs", case)
    shutil.rmtree(capture_at(case.place).root)
    escaped = ascii(name)[1:-1]
    case.said, case.named = f"the {which} is named {name!r}", (name, escaped, escaped.replace("\\", "\\\\"))
    if which == "photograph":
        first = sorted(folder.iterdir())[0]
        first.rename(first.with_name(f"{name[:200]}.jpg"))
    elif which == "photographs":
        folder = folder.rename(folder.with_name(name))
    _run(case, "frames", str(folder), forced=False, frames={"long_side": 320, "views": 3})
    if which == "capture":
        case.command[2] = str(case.place / name)


def _draw_masks(folder: Path) -> None:
    import numpy as np

    from core.imaging import images

    bars = np.broadcast_to(np.arange(256) // 16 % 2, (256, 256)).astype(np.float32)
    images.write_data(folder / "mask.png", bars)
    images.write_linear(folder / "mask.exr", bars[..., None].repeat(3, -1))
    images.write_srgb(folder / "mask.jpg", bars[..., None].repeat(3, -1))


def is_book(case: Case) -> bool:
    """Return whether what was spoiled is one of the capture's own books, which are written over."""
    return case.spoiled is not None and case.spoiled.name in BOOKS
