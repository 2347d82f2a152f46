# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces of a batch: captures with nothing but a video, or finished up to their masks by their own records, over the
stand-in's head; the batch as a terminal plans it, and how the tests wait for what the add-on sees of it."""

import json
import time
from pathlib import Path

from core.batch import record
from core.capture import processes, stages
from core.capture.capture import Capture
from core.settings.settings import Settings
from tests import standin

BEFORE_MASK = stages.STAGES[: stages.NAMES.index(stages.MASK_STAGE) + 1]


def filmed(folder: Path, name: str, mood: dict | None = None) -> Capture:
    """A capture that knows its video; `mood` is for tiny_chain's rooms."""
    folder.mkdir(parents=True, exist_ok=True)
    video = folder / f"{name}.mp4"
    video.write_bytes(name.encode())
    capture = Capture(folder / f"{name}.wildcap")
    capture.set_source(video)
    (capture.root / "mood.json").write_text(json.dumps(mood or {}), encoding="utf-8")
    return capture


def up_to_mask(folder: Path, name: str, settings: Settings | None = None, mood: dict | None = None) -> Capture:
    """One whose stages are recorded as done up to the mask's proposal."""
    standin.make(folder / f"{name}.wildcap", solved=False)
    capture = filmed(folder, name, mood)
    finish_up_to_mask(capture, settings or Settings())
    return capture


def finish_up_to_mask(capture: Capture, settings: Settings) -> None:
    """Every stage up to the mask as done; an output that is not there yet holds its stage's name."""
    for stage in BEFORE_MASK:
        for path in [capture.root / output for output in stage.writes]:
            if not path.suffix and not path.is_dir():
                path.mkdir()
                (path / "a.txt").write_text(stage.name, encoding="utf-8")
            elif not path.exists():
                path.write_text(stage.name, encoding="utf-8")
        capture.finish(stage, capture.conditions(stage, settings), 1.0, settings, {}, "0.2.0")


def planned(folder: Path, *captures: Capture, gate: str = "artist", settings: dict | None = None) -> Path:
    """A batch as a terminal plans it: with its captures in its own folder."""
    faces = [
        record.BatchFace(capture.root.stem, capture.source, capture.root, "draft", settings or {})
        for capture in captures
    ]
    record.write_batch(record.Batch(folder, tuple(faces), gate))
    return folder


def wait(addon, condition, limit_s: float = 60) -> None:
    """Polls as the timer would until the condition holds."""
    deadline = time.monotonic() + limit_s
    while True:
        addon("batch.running")._tick()
        if condition():
            return
        assert time.monotonic() < deadline, (addon("batches").view(), addon("problems").of(""))
        time.sleep(0.02)


def ended(addon, **counts: int) -> None:
    """Waits for the end of the run, and until as many faces are seen in these states."""
    running, module = addon("batch.running"), addon("batches")
    wait(addon, lambda: not running.running())
    wait(addon, lambda: {which: module.view().count(which) for which in counts} == counts)


def seen(module) -> bool:
    """Whether each face was looked at."""
    return module.view().batch is not None and len(module.view().states) == len(module.view().batch.faces)


def alive(pid: int) -> bool:
    """Whether the process runs; on Linux, one that nobody has asked after yet has ended all the same."""
    return not processes.is_gone({"host": processes.name_host(), "pid": pid})
