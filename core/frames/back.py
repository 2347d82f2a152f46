# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool that brings back what was slimmed away: that is all it reads, so the worker has made it again before it
begins."""

from __future__ import annotations

from ..contract.capture import Capture
from ..contract.frame_records import read_frames
from ..contract.messages import Problem, Reporter
from ..contract.settings import Settings
from ..contract.stages import advise_again


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Counts what is there. Raises Problem where a frame is not."""
    records = read_frames(capture).records
    missing = [record.name for record in records if not (capture.frames / record.name).is_file()]
    if missing:
        raise Problem(f"The frame {missing[0]} is not in this capture any more.", advise_again("frames"))
    report.figure("frames", len(records))
    report.figure("delit_views", len(list(capture.delit.glob("*.png"))))
