# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The small capture that is killed: eight frames of the sample video with their true cameras, run once through the real
stages, undisturbed.

A place is a folder with the capture face.wildcap, a file of the user's beside it, and deliveries. Kept are the place as
it was before each stage, the one at the end, and, where they are asked for, the one in which a stage was run with other
settings.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from core.capture import stages
from core.capture.capture import Capture
from core.capture.files import replacing
from core.capture.hashes import read_hash
from core.capture.messages import Done
from core.worker.job import write_job

from .worker import Forked, Moment, fork_worker, in_fork

ROOT = Path(__file__).resolve().parents[3]
SAMPLE = ROOT / "research" / "people" / "sample"
SETTINGS = {
    "frames": {"max_frames": 8, "long_side": 320, "views": 3},
    "cameras": {"import_from": str(SAMPLE / "cameras.json")},
    "scan": {"pairs": 4, "voxel_mm": 5.0},
    "registration": {"iterations": 3},
    "texture": {"size": 256},
    "solve": {"size": 128, "steps": 4, "guidance": "proximal", "grid_cells": 4, "checkpoint_every": 1},
    "upscale": {"size": 1024, "method": "lanczos"},
    "transfer": {"scan_size": 256, "scan_detail_mm": 10.0},
}
"""As little work as every stage takes."""
OTHER = {
    "frames": {"long_side": 352},
    "cameras": {"interpupillary_mm": 64.0},
    "scan": {"voxel_mm": 4.0},
    "registration": {"iterations": 4},
    "delight": {"delighter": "shading"},
    "texture": {"size": 288},
    "shadow_mask": {"sensitivity": 0.8},
    "solve": {"steps": 5},
    "upscale": {"hair": False},
    "transfer": {"scan_size": 288},
}
"""What a stage was run with before, where it is run again."""
DELIVERY = {"preset": "blender", "format": "obj", "whole": True, "size": "1024"}
EARLIER = {**DELIVERY, "hair": False, "roughness": 60}
"""The delivery that is there already."""
STRANGERS = {
    name: f"This is {name}, and not WildCap's.\n".encode()
    for name in (
        "shopping.txt",
        ".mine.tmp",
        "notes/list.txt",
        "frames/retouched.psd",
        "frames/.mine.1.tmp.jpg",
        "cameras/rig.txt",
        "delit/look/a.txt",
        "maps/painted.psd",
        "maps_4k/painted.psd",
        "delivery/notes.txt",
        "report/notes.txt",
        "mask_history/notes.txt",
        "preview/notes.txt",
        "logs/mine.txt",
    )
}
"""Files of the user's in the capture: name -> content."""
GUESTS = {
    name: f"This is {name}, and no delivery's.\n".encode()
    for name in ("render.txt", "textures/painted.psd", ".look/shader.ma")
}
"""The same in a folder of a delivery."""
BESIDE = "anna.txt"


@dataclass
class Undisturbed:
    """One run of the chain with nothing in its way. `folder` holds the places; `names` are the stages that were run, in
    order."""

    folder: Path
    settings: dict
    names: tuple[str, ...]
    seconds: dict[str, float] = field(default_factory=dict)
    changes: dict[str, int] = field(default_factory=dict)  # of files in the capture, as worker counts them
    # name in the capture -> hashes of all complete contents it can have
    known: dict[str, set[str]] = field(default_factory=dict)

    @property
    def end(self) -> Capture:
        return capture_at(self.folder / "end")

    def base(self, stage: str, again: bool) -> Path:
        """The place before a stage was run; or where it has been run, with other settings."""
        if not again:
            return self.folder / f"before_{stage}"
        place = self.folder / f"again_{stage}"
        if not place.is_dir():
            self.copy(self.folder / f"before_{stage}", place)
            run(place, **self.job(stage, **{stage: {**self.settings.get(stage, {}), **OTHER[stage]}}))
            self._learn(capture_at(place))
        return place

    def job(self, stage: str, resumed: bool = False, **changed: dict) -> dict:
        """The job that runs a stage whatever there is, or the one that goes on up to it from what there is; `changed`
        lies over the settings."""
        return {
            "source": SAMPLE / "capture.mp4" if stage == stages.NAMES[0] else "",
            "first": None if resumed else stage,
            "last": stage,
            "settings": {**self.settings, **changed},
        }

    def delivered(self) -> Path:
        """The finished place with a delivery in the capture and one beside it, and files of the user's in both."""
        place = self.folder / "delivered"
        if not place.is_dir():
            self.copy(self.folder / "end", place)
            for target in delivery_folders(place):
                self.deliver(place, target, EARLIER)
                for name, content in GUESTS.items():
                    (target / name).parent.mkdir(exist_ok=True)
                    (target / name).write_bytes(content)
            again = self.folder / "delivered_again"
            self.copy(place, again)
            for target in delivery_folders(again):
                worker = self.deliver(again, target, DELIVERY)
                self.seconds["deliver"], self.changes["deliver"] = time.monotonic() - worker.began, worker.changes
        return place

    def deliver(self, place: Path, target: Path, settings: dict) -> Forked:
        """Deliver the head of a finished place to one of its delivery folders, undisturbed."""
        return run(place, **self.delivery_job(place, target, settings))

    def delivery_job(self, place: Path, target: Path, settings: dict = DELIVERY) -> dict:
        folder = {} if target.is_relative_to(capture_at(place).root) else {"folder": str(target.parent)}
        return {"tool": "deliver", "settings": {**self.settings, "deliver": {**settings, **folder}}}

    def copy(self, place: Path, to: Path) -> Path:
        return shutil.copytree(place, to, symlinks=True)

    def _learn(self, capture: Capture) -> None:
        for path in capture.root.rglob("*"):
            if path.is_file():
                self.known.setdefault(path.relative_to(capture.root).as_posix(), set()).add(read_hash(path))


def run_undisturbed(
    folder: Path, until: str = stages.NAMES[-1], delighter: str = "network", tell: Callable[[str], None] = print
) -> Undisturbed:
    """Run the chain up to a stage, and keeps the place before each and at the end.

    Raises AssertionError where a stage does not end well; and the machine's own errors."""
    names = stages.NAMES[: stages.NAMES.index(until) + 1]
    found = Undisturbed(folder, {**SETTINGS, "delight": {"delighter": delighter}}, names)
    place = folder / "end"
    _plant(place)
    for name in names:
        found.copy(place, folder / f"before_{name}")
        began = time.monotonic()
        worker = run(place, **found.job(name))
        found.seconds[name], found.changes[name] = time.monotonic() - began, worker.changes
        found._learn(capture_at(place))
        tell(f"{name:14}{found.seconds[name]:5.1f} s, {worker.changes} changes")
    return found


def capture_at(place: Path) -> Capture:
    return Capture(place / "face.wildcap")


def start_job(
    place: Path, moment: Moment | None = None, *, log_name: str = "told", limits: dict | None = None, **job
) -> Forked:
    """Write a job and starts a worker at it.

    moment: when the worker is struck; None: never; log_name: ending of the file beside the place that takes its
    output; limits: `term_s` and `most_bytes` of `fork_worker`; job: as `write_job` has it."""
    return fork_worker(
        write_job(capture_at(place), **job), place.with_name(f"{place.name}.{log_name}"), moment, **(limits or {})
    )


def run(place: Path, **job) -> Forked:
    """Run a job to its end, which has to be a good one."""
    worker = start_job(place, **job)
    ended = worker.wait()
    assert isinstance(ended, Done), ended or worker.told.with_suffix(".err").read_text()
    return worker


def delivery_folders(place: Path) -> list[Path]:
    """Where the deliveries in the capture and beside it lie."""
    name = f"face_head_{DELIVERY['preset']}_{DELIVERY['format']}"
    return [capture_at(place).exports / name, place / "out" / name]


def _plant(place: Path) -> None:
    """A new capture with the user's files and two painted masks in it."""
    capture = capture_at(place)
    place.mkdir(parents=True)
    (place / BESIDE).write_bytes(STRANGERS["shopping.txt"])
    capture.claim()
    for name, content in STRANGERS.items():
        (capture.root / name).parent.mkdir(parents=True, exist_ok=True)
        (capture.root / name).write_bytes(content)
    in_fork(
        lambda: [_paint(path, shift) for path, shift in ((capture.shadow_mask, 0), (capture.protect_mask, 9))] and None
    )


def _paint(path: Path, shift: int) -> None:
    """A mask of bars, 256 x 256."""
    import numpy as np

    from core.imaging import images

    with replacing(path) as temporary:
        images.write_data(temporary, np.broadcast_to((np.arange(256) + shift) // 16 % 2, (256, 256)).astype(np.float32))
