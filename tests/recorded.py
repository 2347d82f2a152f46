# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stages recorded as finished without being run: what freshness is tested with."""

from core.contract import freshness
from core.contract.capture import Capture
from core.contract.settings import Settings
from core.contract.stages import Stage


def record(capture: Capture, stage: Stage, settings: Settings) -> None:
    """As if the stage had just ended, with whatever lies in the capture."""
    capture.finish(stage, capture.conditions(stage, settings), 1.0, settings, {}, "0.2.0")


def changed(capture: Capture, stage: Stage, settings: Settings) -> tuple[str, ...]:
    """The inputs and settings of a recorded stage that have changed since."""
    return freshness.judge(capture.root, capture.read(), stage, settings).changed
