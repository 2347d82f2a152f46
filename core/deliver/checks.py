# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether what is delivered is what the capture's inputs and settings ask for."""

from __future__ import annotations

from .. import __version__
from ..capture import stages
from ..capture.capture import Capture
from ..capture.freshness import OLDER, STALE
from ..capture.messages import Problem, Reporter
from ..settings.settings import Settings

LAST = {"head": "upscale", "own_mesh": "transfer", "scan": "transfer"}
"""What is delivered -> the last stage that it comes from. A head's displacement, which the stage after it makes, is
left out where there is none."""


def check_stages(capture: Capture, kind: str, settings: Settings, report: Reporter) -> None:
    """Refuses to deliver what is out of date. What older code made is delivered, and named in the log.

    Parameters
    ----------
    capture : that is delivered
    kind : what of it, a key of LAST
    settings : by which its stages are judged
    report : takes the log line

    Raises
    ------
    Problem
        Naming a stage, of those that `kind` comes from, whose inputs or settings have changed since.
    """
    older = []
    last = stages.NAMES.index(LAST[kind])
    if kind == "head" and (capture.delivery / "displacement.exr").is_file():
        last = stages.NAMES.index("transfer")
    for stage in stages.STAGES[: last + 1]:
        verdict = capture.verdict(stage, settings)
        if verdict.state == STALE:
            raise Problem(
                f"The stage {stage.label} is out of date: {verdict.reason()}.",
                f"Click Reconstruct, or run the stage {stage.label} and those after it again, then deliver.",
            )
        older += [stage.label] if verdict.state == OLDER else []
    if older:
        report.log(
            f"Made by older code and delivered as it is: {', '.join(older)}. Run a stage again to have it made "
            f"by WildCap {__version__}."
        )
