# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Glasses in a capture: it is refused only if nearly all frames agree, as a false refusal is worse than a miss."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...capture.messages import Problem, Reporter

SURE_LOG_ODDS, AGREE_SHARE, FEWEST_FRAMES = 1.0, 0.8, 3
"""Refuse if, of so many frames or more, this share has at least these log odds."""
LIKELY_LOG_ODDS, LIKELY_SHARE = 0.5, 0.5
"""Warn if this share of the frames has at least these log odds."""


def judge(sureness: Sequence[float], no_glasses: bool, report: Reporter) -> None:
    """Judge each frame's log odds of glasses (face.glasses; nan: unknown).

    Raises Problem if the person surely wears glasses and the artist does not say otherwise (no_glasses).
    """
    odds = np.array([each for each in sureness if np.isfinite(each)])
    if not len(odds):
        return
    likely, sure = odds > LIKELY_LOG_ODDS, odds > SURE_LOG_ODDS
    report.figure("frames_with_glasses_percent", round(100 * float(likely.mean())))
    if no_glasses or likely.mean() < LIKELY_SHARE:
        return
    if len(odds) >= FEWEST_FRAMES and sure.mean() >= AGREE_SHARE:
        raise Problem(
            f"The person wears glasses in {sure.sum()} of {len(odds)} frames, and they would become part of the head.",
            "Film without glasses. If there are none, switch on No Glasses in the settings of Frames (--set "
            "frames.no_glasses=true).",
        )
    report.finding(
        f"The person may wear glasses: {likely.sum()} of {len(odds)} frames look like it.",
        "Film without glasses: they distort what lies behind them, and their rims become part of the head.",
    )
