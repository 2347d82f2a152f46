# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures that go on from another one's, and stages that are run in this very process, one after the other."""

import importlib
import shutil
from pathlib import Path

from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.settings.settings import Settings


def begin_at_delight(source: Capture, folder: Path) -> Capture:
    """Return a capture in place of whatever is in the folder: the frames, cameras and head of another one, no more."""
    shutil.rmtree(folder, ignore_errors=True)
    copy = Capture(folder)
    for part in (source.frames, source.cameras):
        shutil.copytree(part, copy.root / part.name)
    shutil.copyfile(source.head, copy.head)
    return copy


def run_stages(capture: Capture, settings: Settings, *stages: str) -> None:
    """Run these stages, whether they are fresh or not; nothing is written to the capture's record."""
    for stage in stages:
        importlib.import_module(f"core.stages.{stage}").run(capture, settings, Reporter(stage))
