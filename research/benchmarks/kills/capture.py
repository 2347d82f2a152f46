# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Small capture that is killed: eight frames of the sample video with their true cameras, run once undisturbed.

A place is a folder with the capture face.wildcap, a file of the user's beside it, and deliveries. The place is kept as
it was before each stage and at the end, and, on demand, after a stage was run with other settings.
"""

import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from core.capture import retouch_edits, retouch_layers, stages
from core.capture.capture import Capture
from core.capture.files import replacing
from core.capture.hashes import read_hash
from core.capture.messages import Done
from core.worker.job import write_job

from ..figures import SAMPLE
from .worker import Forked, Moment, fork_worker, in_fork

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
"""Least work of every stage."""
OTHER = {
    "frames": {"long_side": 352},
    "cameras": {"interpupillary_mm": 64.0},
    "scan": {"voxel_mm": 4.0},
    "registration": {"iterations": 4},
    "delight": {"delighter": "shading"},
    "texture": {"size": 288},
    "shadow_mask": {"sensitivity": 0.8},
    "solve": {"steps": 5},
    "retouch": {"size": 1024},
    "upscale": {"hair": False},
    "transfer": {"scan_size": 288},
}
"""Settings of the earlier run, where a stage is run again."""
DELIVERY = {"preset": "blender", "format": "obj", "whole": True, "size": "1024"}
EARLIER = {**DELIVERY, "hair": False, "roughness": 60}
"""Settings of the delivery that is there already."""
STRANGERS = {
    name: f"This is {name}, and not WildCap's.\n".encode()
    for name in (
        "shopping.txt .mine.tmp notes/list.txt frames/retouched.psd frames/.mine.1.tmp.jpg cameras/rig.txt "
        "delit/look/a.txt maps/painted.psd maps_4k/painted.psd delivery/notes.txt report/notes.txt "
        "mask_history/notes.txt preview/notes.txt logs/mine.txt"
    ).split()
}
"""User's files in the capture: name -> content."""
GUESTS = {
    name: f"This is {name}, and no delivery's.\n".encode()
    for name in ("render.txt", "textures/painted.psd", ".look/shader.ma")
}
"""User's files in the folder of a delivery."""
BESIDE = "anna.txt"
LAYER = "Spot"
"""Name of the artist's layer."""


@dataclass
class Undisturbed:
    """One run of the chain with nothing in its way; `folder` holds the places, `names` the stages in order.

    seconds, changes: of each stage, and of the delivery; known: name in the capture -> hashes of its complete contents.
    """

    folder: Path
    settings: dict
    names: tuple[str, ...]
    seconds: dict[str, float] = field(default_factory=dict)
    changes: dict[str, int] = field(default_factory=dict)
    known: dict[str, set[str]] = field(default_factory=dict)

    @property
    def end(self) -> Capture:
        return capture_at(self.folder / "end")

    def base(self, stage: str, again: bool) -> Path:
        """Return the place before a stage was run; `again`: after it was run with other settings."""
        if not again:
            return self.folder / f"before_{stage}"
        place = self.folder / f"again_{stage}"
        if not place.is_dir():
            copy_place(self.folder / f"before_{stage}", place)
            run(place, **self.job(stage, **{stage: {**self.settings.get(stage, {}), **OTHER[stage]}}))
            self.learn(place)
        return place

    def job(self, stage: str, resumed: bool = False, **changed: dict) -> dict:
        """Return the job that runs a stage in any case, or, `resumed`, goes on up to it; `changed` settings win."""
        return {
            "source": SAMPLE / "capture.mp4" if stage == stages.NAMES[0] else "",
            "first": None if resumed else stage,
            "last": stage,
            "settings": {**self.settings, **changed},
        }

    def delivered(self) -> Path:
        """Return the finished place with a delivery in the capture and one beside it, and the user's files in both."""
        place = self.folder / "delivered"
        if not place.is_dir():
            copy_place(self.folder / "end", place)
            for target in delivery_folders(place):
                run(place, **self.delivery_job(place, target, EARLIER))
                for name, content in GUESTS.items():
                    (target / name).parent.mkdir(exist_ok=True)
                    (target / name).write_bytes(content)
            again = copy_place(place, self.folder / "delivered_again")
            for target in delivery_folders(again):
                self.measure("deliver", again, self.delivery_job(again, target))
        return place

    def delivery_job(self, place: Path, target: Path, settings: dict = DELIVERY) -> dict:
        folder = {} if target.is_relative_to(capture_at(place).root) else {"folder": str(target.parent)}
        return {"tool": "deliver", "settings": {**self.settings, "deliver": {**settings, **folder}}}

    def measure(self, name: str, place: Path, job: dict) -> None:
        """Run a job, and keep its time and changes under a name."""
        worker = run(place, **job)
        self.seconds[name], self.changes[name] = time.monotonic() - worker.began, worker.changes

    def learn(self, place: Path) -> None:
        """Add the contents of a capture to those that are known as complete."""
        root = capture_at(place).root
        for path in (path for path in root.rglob("*") if path.is_file()):
            self.known.setdefault(path.relative_to(root).as_posix(), set()).add(read_hash(path))


def run_undisturbed(
    folder: Path, until: str = stages.NAMES[-1], delighter: str = "network", tell: Callable[[str], None] = print
) -> Undisturbed:
    """Run the chain up to a stage, and keep the place before each stage and at the end."""
    names = stages.NAMES[: stages.NAMES.index(until) + 1]
    found = Undisturbed(folder, {**SETTINGS, "delight": {"delighter": delighter}}, names)
    place = folder / "end"
    _plant(place)
    for name in names:
        copy_place(place, folder / f"before_{name}")
        found.measure(name, place, found.job(name))
        found.learn(place)
        tell(f"{name:14}{found.seconds[name]:5.1f} s, {found.changes[name]} changes")
    return found


def capture_at(place: Path) -> Capture:
    return Capture(place / "face.wildcap")


def copy_place(place: Path, to: Path) -> Path:
    return shutil.copytree(place, to, symlinks=True)


def start_job(place: Path, moment: Moment | None = None, term_s: float | None = None, **job) -> Forked:
    """Write a job, as `write_job` takes it, and fork a worker for it; its output goes to a file beside the place."""
    log = place.with_name(f"{place.name}.told")
    return fork_worker(write_job(capture_at(place), **job), log, moment, **({"term_s": term_s} if term_s else {}))


def run(place: Path, **job) -> Forked:
    """Run a job to its end, which must be a good one."""
    worker = start_job(place, **job)
    ended = worker.wait()
    assert isinstance(ended, Done), ended or worker.errors
    return worker


def delivery_folders(place: Path) -> list[Path]:
    """Return the folders of the deliveries in the capture and beside it."""
    name = f"face_head_{DELIVERY['preset']}_{DELIVERY['format']}"
    return [capture_at(place).exports / name, place / "out" / name]


def _plant(place: Path) -> None:
    """Make a new capture with the user's files, two painted masks and a layer in it."""
    capture = capture_at(place)
    place.mkdir(parents=True)
    (place / BESIDE).write_bytes(STRANGERS["shopping.txt"])
    capture.claim()
    for name, content in STRANGERS.items():
        (capture.root / name).parent.mkdir(parents=True, exist_ok=True)
        (capture.root / name).write_bytes(content)
    for path, shift in ((capture.shadow_mask, 0), (capture.protect_mask, 9)):
        in_fork(lambda path=path, shift=shift: _paint(path, shift))
    layer = retouch_edits.add_layer(capture, LAYER, "albedo")
    in_fork(lambda: _paint_layer(retouch_layers.picture_of(capture, layer)))


def _paint_layer(path: Path) -> None:
    """Write a layer with a dark spot on a cheek, 256 x 256."""
    import numpy as np

    from core.imaging import images

    row, column = np.mgrid[:256, :256] / 256
    spot = np.hypot(row - 0.62, column - 0.3) < 0.03
    with replacing(path) as temporary:
        images.write_packed(temporary, np.stack([0.3 * spot, 0.2 * spot, 0.15 * spot, spot], 2), bits=16, srgb=True)


def _paint(path: Path, shift: int) -> None:
    """Write a mask of bars, 256 x 256."""
    import numpy as np

    from core.imaging import images

    with replacing(path) as temporary:
        images.write_data(temporary, np.broadcast_to((np.arange(256) + shift) // 16 % 2, (256, 256)).astype(np.float32))
