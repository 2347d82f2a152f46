# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Trials of what is no stage: the add-on's saving of a mask, a delivery over an older one, and COLMAP's process beside
the worker."""

from __future__ import annotations

import importlib
import json
import os
import signal
import sys
import time
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from core.capture import stages
from core.capture.delivery_plan import PROVENANCE
from core.capture.messages import Done, Failed

from .capture import GUESTS, ROOT, capture_at, delivery_folders, start_job
from .judge import tree
from .trials import KillTrial, wait_until
from .worker import Forked, Moment, in_fork, running_at

MASKS = {'SHADOW': "shadow_mask.png", 'PROTECT': "protect_mask.png"}
SIDE, SAVES = 1024, 3
SAVE_CHANGES = 34
"""About as many changes as that many saves make, the first of them with a copy for the history."""
COLMAP_S = 2.5
PARTING_S = 5.0
"""In which a process ends whose parent is gone."""


def saving(trial: KillTrial) -> None:
    """The add-on is killed while it saves a mask several times, in half of the trials while a worker is at the capture:
    the mask is the old one or one of the new, and the old one is in the history where it was replaced."""
    # no mask is an input of theirs
    early = [
        name for name in trial.undisturbed.names if stages.NAMES.index(name) <= stages.NAMES.index(stages.MASK_STAGE)
    ]
    stage, which, busy = trial.rng.choice(early), trial.rng.choice(list(MASKS)), trial.rng.random() < 0.5
    trial.undisturbed.copy(trial.undisturbed.folder / "end", trial.place)
    capture, name = capture_at(trial.place), MASKS[which]
    old, painted = (capture.root / name).read_bytes(), trial.place.with_name(f"{trial.place.name}.painted")
    moment = Moment(
        write=trial.rng.randint(1, SAVE_CHANGES), late_s=trial.rng.choice((0.0, trial.rng.uniform(0, 0.01)))
    )
    trial.where = f"{which.lower()} mask, {moment}{f', while {stage} is run' if busy else ''}"
    seed = trial.rng.randrange(2**31)
    addon = Forked(
        lambda: _save_masks(capture.root, which, seed, painted),
        trial.place,
        trial.place.with_name(f"{trial.place.name}.addon"),
        moment,
    )
    worker = None
    if busy:
        wait_until(lambda: painted.is_dir() or addon.ended(), 60)
        worker = start_job(trial.place, **trial.undisturbed.job(stage))
    trial.struck += addon.strike()
    if addon.code and addon.code > 0:
        trial.faults.append(f"the add-on could not save: {addon.told.with_suffix('.err').read_text()[-400:]}")
    new = [path.read_bytes() for path in sorted(painted.glob("*.png"))] if painted.is_dir() else []
    masks = {name: (old, *new)}
    if worker is None:
        trial.judge_kill(masks)
    elif not isinstance(ended := worker.wait(), Done):
        trial.faults.append(f"the worker beside the add-on ended with {ended}")
    trial.resume(stage, masks)
    kept = [path.read_bytes() for path in capture.mask_history.glob("*.png")]
    if (capture.root / name).read_bytes() != old and old not in kept:
        trial.fault("the mask that was there before is not in the history")
    if any(content not in (old, *new) for content in kept):
        trial.fault("the history has an incomplete mask")


def _save_masks(root: Path, mask_kind: str, seed: int, painted: Path) -> None:
    """What the add-on does after strokes, in this process; what the files are to hold goes to `painted` first."""
    import numpy as np

    spec = spec_from_file_location("wildcap", ROOT / "__init__.py", submodule_search_locations=[str(ROOT)])
    sys.modules["wildcap"] = module_from_spec(spec)
    spec.loader.exec_module(sys.modules["wildcap"])
    keeping, mask_image, folder = (
        importlib.import_module(f"wildcap.{name}")
        for name in ("wildcap_addon.paint.keeping", "wildcap_addon.paint.mask_image", "core.capture.capture")
    )
    rng = np.random.default_rng(seed)
    masks = [rng.random((SIDE, SIDE), np.float32) for _ in range(SAVES)]
    half = painted.with_suffix(".half")
    half.mkdir()
    for number, mask in enumerate(masks):
        (half / f"{number}.png").write_bytes(mask_image.grey_png(mask))
    half.rename(painted)
    stamp = ()
    for mask in masks:
        stamp = keeping.store_painting(mask, folder.Capture(root), mask_kind, stamp)


def delivering(trial: KillTrial) -> None:
    """A delivery over an older one is killed, up to twice, and then made: the folder holds the old one or the new one,
    and the user's files stay."""
    base = trial.undisturbed.delivered()
    trial.undisturbed.copy(base, trial.place)
    beside, writing = trial.rng.random() < 0.5, trial.rng.random() < 0.7
    target, earlier, new = (
        delivery_folders(place)[beside] for place in (trial.place, base, base.with_name("delivered_again"))
    )
    job, known = trial.undisturbed.delivery_job(trial.place, target), (_delivery(earlier), _delivery(new))
    trial.where = "beside the capture" if beside else "in the capture"
    for _ in range(1 + (trial.rng.random() < 0.3)):
        moment = trial.moment("deliver", writing)
        trial.where += f", {moment}"
        trial.struck += start_job(trial.place, moment, **job).strike()
        trial.judge_kill(within=("exports/",))
        if target.is_dir() and _delivery(target) not in known:
            trial.fault("after the kill: the delivery is neither the old nor the new one")
        trial.faults += [f"after the kill: {fault}" for fault in _gone(target, target.with_name(f".{target.name}.old"))]
    ended = start_job(trial.place, **job).wait()
    if not isinstance(ended, Done):
        trial.fault(f"the delivery did not end well: {ended}")
    elif _delivery(target) != known[1]:
        trial.fault("the delivery is not as the undisturbed one")
    trial.faults += _gone(target)
    trial.judge_end(trial.undisturbed.names[-1], unlike_folders=("exports/",))


def _gone(*folders: Path) -> list[str]:
    """The user's files that lie, as they were, in none of these folders of a delivery."""
    return [
        f"the user's {name} in the delivery is gone"
        for name, content in GUESTS.items()
        if not any((folder / name).is_file() and (folder / name).read_bytes() == content for folder in folders)
    ]


def _delivery(target: Path) -> dict[str, str]:
    """The files of a delivery but the user's: name -> content hash. Provenance tells times: it is whole where it can be
    read."""
    found = {name: digest for name, digest in tree(target).items() if name not in GUESTS}
    if PROVENANCE in found:
        found[PROVENANCE] = ",".join(sorted(json.loads((target / PROVENANCE).read_text(encoding="utf-8"))))
    return found


def colmap(trial: KillTrial) -> None:
    """While COLMAP places the cameras: its process is killed, or the worker's alone, or both. The one that is left
    ends, and the next run finds cameras."""
    trial.undisturbed.copy(trial.undisturbed.base("cameras", again=trial.rng.random() < 0.5), trial.place)
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
    told = isinstance(ended, Done) or isinstance(ended, Failed) and "camera solver stopped" in ended.problem
    if running and victim == "COLMAP" and not told:
        trial.fault(f"the worker without its COLMAP ended with {ended}")
    wait_until(lambda: not running_at(trial.place), PARTING_S)
    trial.faults += [f"process {pid} outlived its worker" for pid in running_at(trial.place)]
    within = ("cameras/", "report/cameras")
    trial.judge_kill(within=within)
    ended = start_job(trial.place, **{**job, "first": None}).wait()
    if not isinstance(ended, Done):
        trial.fault(f"the resumed run did not end well: {ended}")
    elif (placed := in_fork(lambda: _placed(capture_at(trial.place).cameras))) < 3:
        trial.fault(f"the resumed run placed {placed} cameras")
    trial.judge_end("cameras", unlike=("cameras",), unlike_folders=within)


def _placed(folder: Path) -> int:
    from core.geometry.models import read_model

    return read_model(folder).num_reg_images()
