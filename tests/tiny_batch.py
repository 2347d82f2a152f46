# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches over the tiny chain: rooms of a few lines behind the real command line, with a delivery of its own."""

import json
import subprocess
import sys
from pathlib import Path

from core.batch.record import Batch, read_batch
from core.capture.capture import Capture
from tests import tiny_chain

DELIVER = '''
from ..capture import delivery_plan, provenance
from ..capture.files import replacing_folder, write_json
from ..capture.messages import Problem

def run(capture, settings, report):
    plan = delivery_plan.plan(capture, settings.deliver)
    delivery_plan.check_target(plan)
    with replacing_folder(plan.staged) as folder:
        (folder / plan.mesh).write_text(capture.head.read_text())
        write_json(folder / delivery_plan.PROVENANCE, provenance.collect(capture, plan, settings, report.check))
        provenance.finish(folder)
    delivery_plan.put_in_place(plan)
'''


def build(folder: Path) -> Path:
    """The worker's root, as tiny_chain.build makes it."""
    root = tiny_chain.build(folder)
    tiny_chain.keep_pace(root)
    (root / "core" / "deliver").mkdir()
    (root / "core" / "deliver" / "__init__.py").write_text(DELIVER, encoding="utf-8")
    tiny_chain.compile_once(root)
    return root


def core(code: Path, *words) -> subprocess.CompletedProcess:
    """`python -m core` with these words, by the tiny rooms."""
    return subprocess.run(
        [sys.executable, "-B", "-m", "core", *map(str, words)], cwd=code, capture_output=True, text=True, timeout=120
    )


def start(code: Path, *words) -> subprocess.Popen:
    """The same, not waited for."""
    return subprocess.Popen(
        [sys.executable, "-B", "-m", "core", *map(str, words)],
        cwd=code,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def make(code: Path, folder: Path, names: str = "abc", moods: dict | None = None, *options) -> Batch:
    """A batch of films with these one-letter names in FOLDER/batch; `moods`: how the rooms misbehave, {face: {stage:
    mood}}."""
    films = folder / "films"
    films.mkdir()
    for name in names:
        (films / f"{name}.mp4").write_bytes(name.encode())
    planned = core(code, "batch", "plan", films, folder / "batch", *options)
    assert planned.returncode == 0, planned.stderr
    batch = read_batch(folder / "batch")
    for face in batch.faces:
        set_mood(face.capture, (moods or {}).get(face.name, {}))
    return batch


def set_mood(capture: Capture, mood: dict) -> None:
    capture.claim()
    (capture.root / "mood.json").write_text(json.dumps(mood))


def states(batch: Batch) -> dict[str, str]:
    from core.batch.state import derive_state

    return {face.name: derive_state(batch, face).state for face in batch.faces}


def finished(batch: Batch) -> dict[str, dict]:
    """When each stage of each face ended, and the bytes that it wrote: the same twice where nothing was done twice."""
    return {
        face.name: {
            name: (stage["finished"], stage["seconds"]) for name, stage in face.capture.read()["stages"].items()
        }
        for face in batch.faces
    }
