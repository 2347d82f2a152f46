# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stages recorded as finished without being run: what freshness is tested with."""

from pathlib import Path

from core.capture import freshness, stages
from core.capture.capture import Capture
from core.capture.stages import Stage
from core.settings.settings import Settings

FRAMES, CAMERAS = stages.by_name("frames"), stages.by_name("cameras")


def make(root: Path) -> Capture:
    """A capture with frames and cameras that were made from them, beside its film."""
    capture, film = Capture(root), root.parent / "film.mp4"
    film.parent.mkdir(exist_ok=True)
    film.write_bytes(b"film")
    capture.set_source(film)
    for folder in (capture.frames, capture.cameras):
        folder.mkdir()
        (folder / "a.bin").write_bytes(b"1")
    for stage in (FRAMES, CAMERAS):
        record(capture, stage, Settings())
    return capture


def states(capture: Capture, settings: Settings | None = None) -> list[str]:
    """Of its frames and its cameras."""
    return [capture.state(stage, settings or Settings()) for stage in (FRAMES, CAMERAS)]


def record(capture: Capture, stage: Stage, settings: Settings) -> None:
    """As if the stage had just ended, with whatever lies in the capture."""
    capture.finish(stage, capture.conditions(stage, settings), 1.5, settings, {"count": 3}, "0.2.0")


def make_entry(**told) -> dict:
    """What capture.json keeps of a finished stage, as a test writes it by hand: `told`, and the rest empty."""
    return {
        "inputs": {},
        "code": "",
        "seconds": 1.0,
        "finished": "2026-11-22T00:00:00",
        "version": "0.2.0",
        "settings": {},
        "seed": 0,
        "device": "cpu",
        "figures": {},
        "findings": [],
        **told,
    }


def changed(capture: Capture, stage: Stage, settings: Settings) -> tuple[str, ...]:
    """The inputs and settings of a recorded stage that have changed since."""
    return freshness.judge_stage(capture.root, capture.read(), stage, settings).changed
