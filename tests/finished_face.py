# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A face whose whole chain has run, by the real worker over tiny rooms (tiny_chain.py), and what lies in it: what
slimming is tested with."""

import shutil
from pathlib import Path

from core.contract import freshness, stages
from core.contract.capture import Capture
from core.contract.code_key import code_key
from core.contract.messages import Done
from core.contract.settings import Settings

from . import kept_capture, tiny_chain
from .tiny_chain import follow, start

BACK = """
def run(capture, settings, report):
    report.figure("frames", len(list(capture.frames.iterdir())))
"""


def build(folder: Path) -> Path:
    """The code tree with the tool that brings back what was slimmed away; the worker's root."""
    root = tiny_chain.build(folder)
    (root / "core" / "frames" / "back.py").write_text(BACK, encoding="utf-8")
    return root


def make(root: Path, folder: Path) -> Path:
    """`folder`, now with a film and the face of it."""
    (folder / "film.mp4").write_bytes(b"stands in for a video")
    assert isinstance(follow(start(root, Capture(folder / "zoë.wildcap"), source=folder / "film.mp4"))[-1], Done)
    return folder


def copy(finished: Path, to: Path, root: Path, monkeypatch) -> Capture:
    """The face in a copy of such a folder, judged by the code that made it: the tiny rooms'."""
    shutil.copytree(finished, to)
    monkeypatch.setattr(
        freshness,
        "code_key",
        {stage.module: code_key(stage.module, root / "core") for stage in stages.STAGES}.__getitem__,
    )
    return Capture(to / "zoë.wildcap")


def states(capture: Capture) -> set[str]:
    return {capture.state(stage, Settings()) for stage in stages.STAGES}


def pictures(capture: Capture) -> dict[str, bytes]:
    """What slimming takes away, as far as it is there."""
    return {
        name: content
        for name, content in kept_capture.contents(capture.root).items()
        if name.startswith(stages.SLIMMED)
    }
