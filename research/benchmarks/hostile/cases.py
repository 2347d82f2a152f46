# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Kinds of hostile cases: what is spoiled, and the command that reads it."""

import json
import os
import random
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from core.capture import stages

from ..figures import SAMPLE
from ..kills.capture import DELIVERY, Undisturbed, capture_at
from ..kills.worker import in_fork
from . import films
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
SETTINGS = (
    "frames.views",
    "solve.skin_tone",
    "delight.delighter",
    "scan.voxel_mm",
    "none.such",
    "registration.template",
    "",
    "seed",
    "frames",
)
SMALL = {"long_side": 320, "views": 3}


@dataclass
class Case:
    """A command line, the spoiled file with the names by which a refusal may call it, and the outputs if it is taken.

    content: of the spoiled file, which must be somewhere afterwards; sound_picture: a photograph before it was spoiled;
    clean: the folder of the pictures that a film shows; outcome: of those in films.
    """

    place: Path
    command: list[str] = ()
    spoiled: Path | None = None
    named: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    description: str = ""
    content: bytes | None = None
    sound_picture: Path | None = None
    clean: Path | None = None
    outcome: str = films.ANY

    @property
    def root(self) -> Path:
        return capture_at(self.place).root

    def run(self, stage: str, source: str = "-", forced: bool = True, **settings: dict) -> None:
        """Run one stage with the settings of the undisturbed run and others."""
        job = self.root / "job.json"
        base = json.loads(job.read_text())["settings"] if job.is_file() else {}
        chosen = self.place / "chosen.json"
        changed = {name: {**base.get(name, {}), **values} for name, values in settings.items()}
        chosen.write_text(json.dumps({**base, **changed}))
        self.command = ["run", source, str(self.root), "--settings", str(chosen), "--until", stage]
        self.command += ["--from", stage] if forced else []
        self.outputs = stages.by_name(stage).writes

    def spoil(self, path: Path, rng: random.Random, *named: str) -> None:
        """Spoil a file, or one of a folder's; `named`: further names by which a refusal may call it."""
        path = rng.choice(sorted(path.iterdir())) if path.is_dir() else path
        # picture libraries start threads, which no process that forks may have
        words = in_fork(lambda: mutate(path, rng))
        self.spoiled, self.description = path, f"{path.relative_to(self.place)}: {words}"
        folder = path.parent.name
        of_folder = (folder,) if folder in ("cameras", "model", "frames", "delit", "photographs") else ()
        self.named = (path.name, *of_folder, *named)


class Stock:
    """Undisturbed run, and files as users bring them: a film, photographs, masks, landmarks, cameras, a mesh."""

    def __init__(self, undisturbed: Undisturbed, folder: Path):
        self.undisturbed, self.folder, end = undisturbed, folder, undisturbed.end
        folder.mkdir()
        shutil.copy(SAMPLE / "capture.mp4", folder / "film.mp4")
        in_fork(lambda: _make_clean(folder))
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
        """Copy a file or folder of the stock beside the case's capture."""
        place = case.place / "brought" / name
        place.parent.mkdir(exist_ok=True)
        (shutil.copytree if (self.folder / name).is_dir() else shutil.copy)(self.folder / name, place)
        return place


def make_case(kind: "Kind", place: Path, stock: Stock, rng: random.Random) -> Case:
    """Make a new case; its capture is of hard links: nothing may write into a file that is there."""
    shutil.copytree(stock.undisturbed.folder / "end", place, symlinks=True, copy_function=os.link)
    case = Case(place)
    kind.make(case, stock, rng)
    if case.spoiled is not None and case.spoiled.is_file() and not case.spoiled.is_symlink():
        case.content = case.spoiled.read_bytes()
    return case


def read_by_stage(case: Case, stock: Stock, rng: random.Random, stage: stages.Stage) -> None:
    """Spoil a file that a stage reads of the stages before it."""
    case.run(stage.name)
    paths = [case.root / name for name in (*stage.reads, *stage.optional_reads)]
    files = [file for path in paths for file in ([path] if path.is_file() else sorted(path.glob("*.*")))]
    users = ("retouched.psd", "rig.txt")
    ours = [file for file in files if file.name not in users and not file.name.startswith(".") and file.is_file()]
    # the pictures may no longer fit cameras.json
    case.spoil(rng.choice(ours), rng, *(["cameras.json"] if stage.name == "cameras" else []))


def book(case: Case, stock: Stock, rng: random.Random) -> None:
    """Spoil one of the capture's own records."""
    name = rng.choice(["capture.json"] * 4 + ["job.json"] * 2 + ["written.jsonl", "lock", "frames/frames.json"])
    command = rng.choice(["status", "run", "run", "delete"])
    case.run("cameras", forced=False)
    if command != "run":
        case.command, case.outputs = [command, str(case.root)], ()
    if name == "lock":
        (case.root / name).write_text(json.dumps({"host": "elsewhere", "pid": 1, "began": 1.0, "token": "t"}))
    case.spoil(case.root / name, rng, "capture.json", str(case.root), "This capture")


def source(case: Case, stock: Stock, rng: random.Random, name: str, **settings) -> None:
    """Begin a new capture with a spoiled film, or with photographs of which one is spoiled."""
    brought = stock.bring(name, case)
    shutil.rmtree(case.root)
    case.run("frames", str(brought), forced=False, frames=settings)
    case.spoil(brought, rng)
    case.sound_picture = stock.folder / name / case.spoiled.name if brought.is_dir() else None


def film(case: Case, stock: Stock, rng: random.Random) -> None:
    """Begin a new capture with a film in other streams, containers, transfers, fields, times."""
    (case.place / "brought").mkdir()
    brought = case.place / "brought" / "film.mp4"
    shutil.copy(stock.folder / "small.mp4", brought)
    shutil.rmtree(case.root)
    words, case.outcome = in_fork(lambda: films.respoil(brought, rng))
    case.run("frames", str(brought), forced=False, frames={"max_frames": 8, **SMALL})
    case.spoiled, case.named, case.clean = brought, (brought.name, "frame", "face"), stock.folder / "clean"
    case.description = f"{brought.relative_to(case.place)}: {words}"


def imported(case: Case, stock: Stock, rng: random.Random, names: list[str], output: str) -> None:
    """Import a spoiled mask or spoiled landmarks by their command."""
    brought = stock.bring(rng.choice(names), case)
    case.command, case.outputs = [brought.stem, "import", str(case.root), str(brought)], (output,)
    case.spoil(brought, rng)


def setting(case: Case, stock: Stock, rng: random.Random, stage: str, names: list[str], key: str, **more) -> None:
    """Run a stage with a setting that names a spoiled file or folder."""
    brought = stock.bring(rng.choice(names), case)
    case.run(stage, **{stage: {key: str(brought), **more}})
    case.spoil(brought, rng, brought.name)


def settings(case: Case, stock: Stock, rng: random.Random) -> None:
    """Spoil a file of settings, or give an odd value by --set."""
    case.command = ["run", "-", str(case.root), "--until", "frames"]
    if rng.random() < 0.5:
        chosen = stock.bring("settings.json", case)
        case.command += ["--settings", str(chosen)]
        case.spoil(chosen, rng, "--settings", "frames.", "scan.", "seed")
    else:
        name, value = rng.choice(SETTINGS), rng.choice([*map(str, VALUES[3:-1]), "nan", "1e999", "0,0,0", "-5", "on"])
        value = value.encode("utf-8", "replace").decode().replace("\0", "")
        case.command += [f"--set={name}={value[:500]}"]
        case.description = f"--set {name}={value[:60]!r}"
        last = name.rpartition(".")[2] or "--set"
        case.named = (name or "''", "--set", last, last.replace("_", " "))


def deliver(case: Case, stock: Stock, rng: random.Random) -> None:
    """Deliver a head whose mesh or one of whose maps is spoiled."""
    capture = capture_at(case.place)
    maps = [path for folder in (capture.maps, capture.maps_4k) for path in sorted(folder.glob("*.*"))]
    chosen = ("deliver.format=obj", f"deliver.preset={DELIVERY['preset']}", "deliver.size=1024")
    case.command = ["deliver", str(case.root), "--to", str(case.place / "out"), *(f"--set={each}" for each in chosen)]
    case.spoil(rng.choice([capture.head, *(path for path in maps if path.suffix in (".png", ".exr"))]), rng)


def odd_name(case: Case, stock: Stock, rng: random.Random) -> None:
    """Give an odd name to the capture, the folder of photographs, or one of these."""
    name, which = rng.choice(NAMES), rng.choice(["capture", "photographs", "photograph"])
    folder = stock.bring("photographs", case)
    shutil.rmtree(case.root)
    escaped = ascii(name)[1:-1]
    case.description, case.named = f"the {which} is named {name!r}", (name, escaped, escaped.replace("\\", "\\\\"))
    if which == "photograph":
        first = sorted(folder.iterdir())[0]
        first.rename(first.with_name(f"{name[:200]}.jpg"))
    elif which == "photographs":
        folder = folder.rename(folder.with_name(name))
    case.run("frames", str(folder), forced=False, frames=SMALL)
    if which == "capture":
        case.command[2] = str(case.place / name)


@dataclass(frozen=True)
class Kind:
    """Function that makes a case of a copy of the finished capture, its weight, and the stage that must have run."""

    make: Callable[[Case, Stock, random.Random], None]
    weight: int = 4
    needs: str = stages.NAMES[0]


KINDS = {
    **{
        f"stage {stage.name}": Kind(partial(read_by_stage, stage=stage), CHEAP.get(stage.name, 1), stage.name)
        for stage in stages.STAGES[1:]
    },
    "books": Kind(book, 8),
    "video": Kind(partial(source, name="film.mp4", max_frames=8, **SMALL)),
    "films": Kind(film, 12),
    "photographs": Kind(partial(source, name="photographs", **SMALL)),
    "mask": Kind(partial(imported, names=["mask.png", "mask.exr", "mask.jpg"], output="shadow_mask.png"), 6),
    "landmarks": Kind(partial(imported, names=["landmarks.json"], output="landmarks_artist.json")),
    "settings": Kind(settings),
    "cameras": Kind(
        partial(setting, stage="cameras", names=["model", "cameras.json"], key="import_from"), 4, "cameras"
    ),
    "names": Kind(odd_name),
    "own mesh": Kind(partial(setting, stage="registration", names=["mesh.obj"], key="template"), 1, "registration"),
    "delit pictures": Kind(
        partial(setting, stage="delight", names=["delit"], key="folder", delighter="folder"), 3, "delight"
    ),
    "deliver": Kind(deliver, 4, "solve"),
}


def _make_clean(folder: Path) -> None:
    """Make the small film, and the pictures that it shows."""
    from core.capture.messages import Reporter
    from core.imaging import images
    from core.stages.frames.video import read_video

    films.make_clean(folder / "film.mp4", folder / "small.mp4")
    for picture in read_video(folder / "small.mp4", 8, SMALL["long_side"], Reporter("frames")):
        images.write_srgb(folder / "clean" / f"{picture.index:05d}.png", picture.srgb)


def _draw_masks(folder: Path) -> None:
    import numpy as np

    from core.imaging import images

    bars = np.broadcast_to(np.arange(256) // 16 % 2, (256, 256)).astype(np.float32)
    images.write_data(folder / "mask.png", bars)
    images.write_linear(folder / "mask.exr", bars[..., None].repeat(3, -1))
    images.write_srgb(folder / "mask.jpg", bars[..., None].repeat(3, -1))
