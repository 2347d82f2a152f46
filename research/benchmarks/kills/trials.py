# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Kinds of trial: what begins in a place, what strikes it, and what must hold afterwards."""

import importlib
import json
import os
import random
import shutil
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from core.capture import stages
from core.capture.delivery_plan import PROVENANCE
from core.capture.messages import Done, Failed
from core.capture.retouch_layers import read_layers
from core.worker.client import Worker
from core.worker.job import write_job

from ..figures import ROOT
from ..same_maps import written
from . import disk, judge
from .capture import DELIVERY, GUESTS, LAYER, Undisturbed, capture_at, copy_place, delivery_folders, start_job
from .worker import Forked, Moment, fork_worker, in_fork, running_at

SHORT_TERM_S = 1.0
"""Term of the lease where one worker waits for another that is stopped."""
LATE_S = 0.03
"""Longest delay after a change of a file: the time in which a C++ library writes."""
ROOM, PAGE = 64 << 20, 4096
SPARE = 1.2
"""Share of a stage's files that it may need on the way: some are written twice."""
MASKS = {'SHADOW': "shadow_mask.png", 'PROTECT': "protect_mask.png", 'LAYER': f"retouch/{LAYER}.png"}
MASK_SIDE, SAVES, SAVE_CHANGES = 1024, 3, 34
"""Side of a painted mask, how often it is saved, and about how many changes that makes."""
COLMAP_S, PARTING_S = 2.5, 5.0
"""Latest strike after COLMAP's start; time in which a process ends whose parent is gone."""


@dataclass
class KillTrial:
    """Course and the faults of one trial; `where` tells what was struck and when.

    private: whether full disks are disks of their own.
    """

    number: int
    kind: str
    rng: random.Random
    undisturbed: Undisturbed
    place: Path
    private: bool
    where: str = ""
    struck: int = 0
    faults: list[str] = field(default_factory=list)

    def chance(self, share: float = 0.5) -> bool:
        return self.rng.random() < share

    def moment(self, stage: str, writing: bool) -> Moment:
        """Draw a moment of a stage: in its time, or at one of its changes of files."""
        if not writing:
            return Moment(after_s=self.rng.uniform(0, 1.05 * self.undisturbed.seconds[stage]))
        late = self.rng.uniform(0, LATE_S) if self.chance() else 0.0
        return Moment(write=self.rng.randint(1, self.undisturbed.changes[stage]), late_s=late)

    def draw_stage(self) -> str:
        """Draw a stage, and copy the place before it, or with what other settings made of it."""
        stage, again = self.rng.choice(self.undisturbed.names), self.chance()
        copy_place(self.undisturbed.base(stage, again), self.place)
        self.where = f"{stage}{' again' if again else ''}"
        return stage

    def beside(self, name: str) -> Path:
        """Return a path beside the place."""
        return self.place.with_name(f"{self.place.name}.{name}")

    def check(self, right: object, fault: str) -> None:
        if not right:
            self.faults.append(fault)

    def judge_kill(self, **more) -> None:
        found = judge.judge_kill(self.place, self.undisturbed.known, **more)
        self.faults += [f"after the kill: {fault}" for fault in found]

    def judge_end(self, last: str, **more) -> None:
        self.faults += judge.judge_resume(self.place, self.undisturbed, last, **more)

    def resume(self, stage: str, **more) -> None:
        """Let an undisturbed worker go on, and judge the end."""
        ended = start_job(self.place, **self.undisturbed.job(stage, resumed=True)).wait()
        self.check(isinstance(ended, Done), f"the resumed run did not end well: {ended}")
        self.judge_end(stage, **more)


def killed(trial: KillTrial, writing: bool) -> None:
    """Kill a worker and its group up to three times in a row, then let it end."""
    stage = trial.draw_stage()
    for number in range(1 + trial.chance(0.25) + trial.chance(0.25)):
        moment = trial.moment(stage, writing)
        trial.where += f", {moment}"
        trial.struck += start_job(trial.place, moment, **trial.undisturbed.job(stage, resumed=number > 0)).strike()
        trial.judge_kill()
    trial.resume(stage)


def command(trial: KillTrial) -> None:
    """Kill the worker's command, begun as Blender begins it, while it imports, works or ends."""
    stage = trial.draw_stage()
    capture, after = capture_at(trial.place), trial.rng.uniform(0, 4 + trial.undisturbed.seconds[stage])
    trial.where += f", after {after:.3f} s"
    job = write_job(capture, **trial.undisturbed.job(stage))
    worker = Worker(Path(sys.executable), ROOT, job, capture.logs / "worker.log")

    def over() -> bool:
        worker.poll()
        return not worker.running

    worker.start()
    wait_until(over, after)
    trial.struck += worker.running
    worker.terminate()
    wait_until(over, float("inf"))
    trial.judge_kill()
    trial.resume(stage)


def full(trial: KillTrial) -> None:
    """Fill the disk at a random byte of what a stage writes, then give room again.

    Without disks of their own, limit the size of a file instead.
    """
    place, stage = trial.place, trial.rng.choice(trial.undisturbed.names)
    again, share, end = trial.chance(), trial.rng.random(), trial.undisturbed.end
    sizes = [(end.root / name).stat().st_size for name in written(end, stages.by_name(stage))]
    room = int(share * (SPARE * sum(sizes) if trial.private else max(sizes)))
    base = trial.undisturbed.base(stage, again)
    if trial.private:
        place.mkdir()
        disk.mount(place, ROOM)
    shutil.copytree(base, place, symlinks=True, dirs_exist_ok=True)
    job = write_job(capture_at(place), **trial.undisturbed.job(stage))
    if trial.private:
        pages = sum(-(-path.stat().st_size // PAGE) for path in place.rglob("*") if path.is_file())
        disk.resize(place, (pages + 2) * PAGE + room)
    trial.where = f"{stage}{' again' if again else ''}, {room} bytes {'free' if trial.private else 'in a file'}"
    ended = fork_worker(job, trial.beside("told"), most_bytes=None if trial.private else room).wait()
    trial.struck += isinstance(ended, Failed)
    words = "disk is full" if trial.private else "could not be written"
    named = isinstance(ended, Done) or isinstance(ended, Failed) and words in ended.problem
    trial.check(named, f"on a full disk the worker ended with {ended}")
    trial.judge_kill()
    if trial.private:
        disk.resize(place, ROOM)
    trial.resume(stage)


def asleep(trial: KillTrial) -> None:
    """Stop a worker, let a second one take its place after the lease's term, and wake the first: it changes nothing.

    One that had no lease yet when it was stopped is not replaced, and does its job when it awakes.
    """
    stage = trial.draw_stage()
    moment, meanwhile = trial.moment(stage, writing=False), trial.chance()
    trial.where += f", stopped {moment}, awakes {'meanwhile' if meanwhile else 'afterwards'}"
    first = start_job(trial.place, moment, SHORT_TERM_S, **trial.undisturbed.job(stage))
    if first.strike(signal.SIGSTOP):
        capture = capture_at(trial.place)
        held = capture.lock.exists()
        trial.struck += held
        second = fork_worker(capture.job, trial.beside("second"), term_s=SHORT_TERM_S)
        if meanwhile:
            wait_until(lambda: second.pid == _holder(capture.lock) or second.ended(), 10 * SHORT_TERM_S)
            time.sleep(trial.rng.uniform(0, trial.undisturbed.seconds[stage]))
            first.send(signal.SIGCONT)
        ended = second.wait()
        trial.check(isinstance(ended, Done), f"the second worker did not end well: {ended}")
        before = judge.tree(capture.root)
        if not meanwhile:
            first.send(signal.SIGCONT)
        awake = first.wait()
        changed = {name for name, digest in judge.tree(capture.root).items() if before.get(name) != digest}
        changed -= {"written.jsonl", f"logs/{stage}.log"}
        words = f"the first worker changed {', '.join(sorted(changed))} after it was replaced"
        trial.check(not (held and changed), words)
        refused = isinstance(awake, Failed) and "nother worker" in awake.problem
        trial.check(refused or isinstance(awake, Done), f"the first worker ended with {awake}")
    trial.resume(stage)


def at_once(trial: KillTrial) -> None:
    """Start two workers at one job: one does it; the other is refused by name, or comes late and finds it done."""
    stage = trial.draw_stage()
    job = write_job(capture_at(trial.place), **trial.undisturbed.job(stage))
    workers = [fork_worker(job, trial.beside(name)) for name in ("first", "second")]
    ends = [worker.wait() for worker in workers]
    refused = sum(isinstance(end, Failed) and end.problem.startswith("Another worker") for end in ends)
    done = sum(isinstance(end, Done) for end in ends)
    trial.struck += refused
    trial.check(done and done + refused == 2, f"two at once ended with {ends}")
    trial.judge_kill()
    trial.resume(stage)


def saving(trial: KillTrial) -> None:
    """Kill the add-on while it saves a mask or a layer several times, in half of the trials beside a worker.

    It is the old one or one of the new, and the old one is in the history where it was replaced.
    """
    # neither is an input of these stages
    early = trial.undisturbed.names[: stages.NAMES.index(stages.MASK_STAGE) + 1]
    stage, which, busy = trial.rng.choice(early), trial.rng.choice(list(MASKS)), trial.chance()
    copy_place(trial.undisturbed.folder / "end", trial.place)
    capture, name, painted = capture_at(trial.place), MASKS[which], trial.beside("painted")
    mask = capture.root / name
    old = mask.read_bytes()
    moment = Moment(write=trial.rng.randint(1, SAVE_CHANGES), late_s=trial.rng.choice((0.0, trial.rng.random() / 100)))
    trial.where = f"{name}, {moment}{f', while {stage} is run' if busy else ''}"
    seed = trial.rng.randrange(2**31)
    save = partial(_save_paintings, capture.root, which, seed, painted)
    addon = Forked(save, trial.place, trial.beside("addon"), moment)
    if busy:
        wait_until(lambda: painted.is_dir() or addon.ended(), 60)
        worker = start_job(trial.place, **trial.undisturbed.job(stage))
    trial.struck += addon.strike()
    trial.check(addon.code <= 0, f"the add-on could not save: {addon.errors[-400:]}")
    contents = (old, *(path.read_bytes() for path in sorted(painted.glob("*.png"))))
    masks = {name: contents}
    # the list of layers and the small picture come with the layer
    beside = {"unlike": (f"retouch/{LAYER}.below", "retouch/layers.json")} if which == 'LAYER' else {}
    trial.check(len(read_layers(capture)) == 1, "the list of layers is damaged")
    if busy:
        ended = worker.wait()
        trial.check(isinstance(ended, Done), f"the worker beside the add-on ended with {ended}")
    else:
        trial.judge_kill(masks=masks, **beside)
    trial.resume(stage, masks=masks, **beside)
    kept = [path.read_bytes() for path in capture.mask_history.glob("*.png")]
    trial.check(mask.read_bytes() == old or old in kept, "what was there before is not in the history")
    trial.check(all(content in contents for content in kept), "the history has an incomplete file")


def _save_paintings(root: Path, which: str, seed: int, painted: Path) -> None:
    """Save masks or layers as the add-on does after strokes; copies of the files' contents go to `painted` first."""
    import numpy as np

    spec = spec_from_file_location("wildcap", ROOT / "__init__.py", submodule_search_locations=[str(ROOT)])
    sys.modules["wildcap"] = module_from_spec(spec)
    spec.loader.exec_module(sys.modules["wildcap"])
    keeping, mask_image, mask_painting, layer_painting = (
        importlib.import_module(f"wildcap.wildcap_addon.paint.{name}")
        for name in ("keeping", "mask_image", "mask_painting", "layer_painting")
    )
    capture = importlib.import_module("wildcap.core.capture.capture").Capture(root)
    rng, half = np.random.default_rng(seed), painted.with_suffix(".half")
    canvases = [rng.random((MASK_SIDE, MASK_SIDE, 4), np.float32) for _ in range(SAVES)]
    if which == 'LAYER':
        painting = layer_painting.LayerPainting(capture, f"{LAYER}.png", MASK_SIDE)
        painting.begin(np.zeros((MASK_SIDE, MASK_SIDE, 3), np.float32), b"small")
        contents = [painting.encode(canvas) for canvas in canvases]
    else:
        painting = mask_painting.MaskPainting(capture, which)
        contents = [mask_image.grey_png(mask_image.from_top(canvas)) for canvas in canvases]
    half.mkdir()
    for number, content in enumerate(contents):
        (half / f"{number}.png").write_bytes(content)
    half.rename(painted)
    stamp = ()
    for canvas in canvases:
        stamp = keeping.store_painting(canvas, painting, stamp)


def delivering(trial: KillTrial) -> None:
    """Kill a delivery over an older one up to twice, then make it: the folder holds one of the two, whole."""
    base = trial.undisturbed.delivered()
    copy_place(base, trial.place)
    beside, writing = trial.chance(), trial.chance(0.7)
    places = trial.place, base, base.with_name("delivered_again")
    target, earlier, new = (delivery_folders(place)[beside] for place in places)
    job, whole = trial.undisturbed.delivery_job(trial.place, target, DELIVERY), (_delivery(earlier), _delivery(new))
    trial.where = "beside the capture" if beside else "in the capture"
    for _ in range(1 + trial.chance(0.3)):
        moment = trial.moment("deliver", writing)
        trial.where += f", {moment}"
        trial.struck += start_job(trial.place, moment, **job).strike()
        trial.judge_kill(unlike=("exports/",))
        known = not target.is_dir() or _delivery(target) in whole
        trial.check(known, "after the kill: the delivery is neither the old nor the new one")
        trial.faults += [f"after the kill: {fault}" for fault in _gone(target, target.with_name(f".{target.name}.old"))]
    ended = start_job(trial.place, **job).wait()
    trial.check(isinstance(ended, Done), f"the delivery did not end well: {ended}")
    trial.check(_delivery(target) == whole[1], "the delivery is not as the undisturbed one")
    trial.faults += _gone(target)
    trial.judge_end(trial.undisturbed.names[-1], unlike=("exports/",))


def _gone(*folders: Path) -> list[str]:
    """Find the user's files that lie unchanged in none of these folders of a delivery."""
    return [
        f"the user's {name} in the delivery is gone"
        for name, content in GUESTS.items()
        if not any((folder / name).is_file() and (folder / name).read_bytes() == content for folder in folders)
    ]


def _delivery(target: Path) -> dict[str, str]:
    """Return the content hashes of a delivery without the user's files; of provenance, which holds times, the keys."""
    found = {name: digest for name, digest in judge.tree(target).items() if name not in GUESTS}
    if PROVENANCE in found:
        found[PROVENANCE] = ",".join(sorted(json.loads((target / PROVENANCE).read_text(encoding="utf-8"))))
    return found


def colmap(trial: KillTrial) -> None:
    """Kill COLMAP's process while it places the cameras, or the worker's alone, or both: the next run finds cameras."""
    copy_place(trial.undisturbed.base("cameras", again=trial.chance()), trial.place)
    victim, after = trial.rng.choice(("COLMAP", "worker", "both")), trial.rng.uniform(0, COLMAP_S)
    trial.where = f"{victim}, {after:.3f} s after COLMAP's start"
    job = trial.undisturbed.job("cameras", cameras={})
    worker = start_job(trial.place, **job)
    wait_until(lambda: running_at(trial.place) or worker.ended(), 60)
    time.sleep(after)
    running = running_at(trial.place)
    if running and not worker.ended():
        trial.struck += 1
        for pid in {"COLMAP": running, "worker": [worker.pid], "both": [*running, worker.pid]}[victim]:
            os.kill(pid, signal.SIGKILL)
    ended = worker.wait()
    named = isinstance(ended, Done) or isinstance(ended, Failed) and "camera solver stopped" in ended.problem
    trial.check(named or not running or victim != "COLMAP", f"the worker without its COLMAP ended with {ended}")
    wait_until(lambda: not running_at(trial.place), PARTING_S)
    trial.faults += [f"process {pid} outlived its worker" for pid in running_at(trial.place)]
    unlike = ("cameras/", "report/cameras")
    trial.judge_kill(unlike=unlike)
    ended = start_job(trial.place, **{**job, "first": None}).wait()
    trial.check(
        isinstance(ended, Done) and _placed(trial.place) >= 3, f"the resumed run ended without cameras: {ended}"
    )
    trial.judge_end("cameras", unlike=unlike, unlike_stages=("cameras",))


def _placed(place: Path) -> int:
    """Return the number of frames with a camera."""

    def count() -> int:
        from core.geometry.models import read_model

        return read_model(capture_at(place).cameras).num_reg_images()

    return in_fork(count)


def wait_until(true: Callable[[], object], limit_s: float) -> None:
    """Return when `true` is, or when the time is over."""
    deadline = time.monotonic() + limit_s
    while not true() and time.monotonic() < deadline:
        time.sleep(0.002)


def _holder(lock: Path) -> int | None:
    """Return the process that holds a lock, if any."""
    try:
        return json.loads(lock.read_text(encoding="utf-8"))["pid"]
    except (OSError, ValueError, KeyError):
        return None


@dataclass(frozen=True)
class Kind:
    """Function of a trial, its number in a round, and the stage up to which the chain must have run."""

    run: Callable[[KillTrial], None]
    weight: int
    needs: str = stages.NAMES[0]


KINDS = {
    "moment": Kind(partial(killed, writing=False), 12),
    "write": Kind(partial(killed, writing=True), 12),
    "command": Kind(command, 2),
    "mask": Kind(saving, 6),
    "deliver": Kind(delivering, 6, stages.NAMES[-1]),
    "full": Kind(full, 4),
    "asleep": Kind(asleep, 4),
    "at_once": Kind(at_once, 2),
    "colmap": Kind(colmap, 4, "cameras"),
}
