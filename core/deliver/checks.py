# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Check that a delivery is up to date with the capture's inputs and settings."""

from __future__ import annotations

from .. import __version__
from ..capture import stages
from ..capture.capture import Capture
from ..capture.freshness import OLDER, STALE, TO_DO
from ..capture.messages import Problem, Reporter
from ..settings.settings import Settings


def check_stages(capture: Capture, kind: str, settings: Settings, report: Reporter) -> None:
    """Raise Problem if a stage that `kind` ("head", "own_mesh" or "scan") comes from is stale; log what is older.

    A head comes from the stages up to retouch, and its displacement, if there is one, from transfer.
    """
    to_transfer = kind != "head" or (capture.delivery / "displacement.exr").is_file()
    last = stages.NAMES.index("transfer" if to_transfer else "retouch")
    older = []
    for stage in stages.STAGES[: last + 1]:
        verdict = capture.verdict(stage, settings)
        if verdict.state == STALE:
            raise Problem(
                f"The stage {stage.label} is out of date: {verdict.reason()}.",
                f"Click Reconstruct, or run the stage {stage.label} and those after it again, then deliver.",
            )
        if stage.only_with and verdict.state == TO_DO:
            raise Problem(
                "Layers of your retouch are not in the maps yet.",
                "Click Update Maps under Retouch, or hide the layers; then deliver "
                f"(in a terminal: --from {stage.name}).",
            )
        older += [stage.label] if verdict.state == OLDER else []
    if older:
        report.log(
            f"Made by older code and delivered as it is: {', '.join(older)}. Run a stage again to have it made "
            f"by WildCap {__version__}."
        )
