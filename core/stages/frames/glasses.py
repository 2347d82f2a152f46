# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Glasses in a capture: its frames are asked one by one, and only where nearly all agree is it refused. A false refusal
is worse than a miss."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...capture.messages import Problem, Reporter

SURE_LOG_ODDS, AGREE_SHARE, FEWEST_FRAMES = 1.0, 0.8, 3
"""From which logarithm of the odds a frame is sure of glasses; which share of the frames has to be for a refusal, and
how many have to tell at all."""
LIKELY_LOG_ODDS, LIKELY_SHARE = 0.5, 0.5
"""From which logarithm of the odds a frame counts as one with glasses, and from which share of such frames the report
warns."""


def judge(sureness: Sequence[float], no_glasses: bool, report: Reporter) -> None:
    """sureness: of each frame, as face.glasses tells it, nan where it cannot. Raises Problem where the person surely
    wears glasses and the artist does not say otherwise (no_glasses)."""
    told = np.array([each for each in sureness if np.isfinite(each)])
    if not len(told):
        return
    report.figure("frames_with_glasses_percent", round(100 * float((told > LIKELY_LOG_ODDS).mean())))
    if no_glasses or (told > LIKELY_LOG_ODDS).mean() < LIKELY_SHARE:
        return
    if len(told) >= FEWEST_FRAMES and (told > SURE_LOG_ODDS).mean() >= AGREE_SHARE:
        raise Problem(
            f"The person wears glasses in {(told > SURE_LOG_ODDS).sum()} of {len(told)} frames, which would be built "
            "into the head.",
            "Film without glasses. If there are none, switch on No Glasses in the settings of Frames (--set "
            "frames.no_glasses=true).",
        )
    report.finding(
        f"The person may wear glasses: {(told > LIKELY_LOG_ODDS).sum()} of {len(told)} frames look like it.",
        "Film without glasses: they bend what lies behind them, and rims are built into the head.",
    )
