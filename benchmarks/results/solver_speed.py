# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/solver_speed.md: what a step of the solver takes, and what was done about it."""

from __future__ import annotations

from ..figures import Figures, markdown
from ..pages import Sections, prose

TITLE = "Speed and memory of the solver"
SAYS = "a step of the walk, plain and as it is; the whole stage; an edited part"
RECORDS = ("solver_speed", "edited_part")


def sections(speed: Figures, part: Figures) -> Sections:
    return [("", prose(f"""
        Each row runs in a process of its own, {speed.python_gib:.2f} GiB of whose peak are Python and its libraries;
        two threads, nothing else running. A step is the mean of four that go down the sizes of the walk at 1024.

        - *plain*: float32, channels first, the whole size from the first step on
        - *ours*: bfloat16, channels last, coarse to fine
        - *draft*: closed form instead of the network's gradient; the whole stage takes 30 steps at 512, *standard* 20
          at 1024
        """, markdown(["1024", "a step", "to plain", "peak memory"], [
            [name, f"{row.seconds_per_step:.2f} s", f"{row.to_plain:.2f}", f"{row.peak_gib:.2f} GiB"]
            for name, row in speed.steps.items()]),
        markdown(["the whole stage, loading included", "seconds", "allowed", "peak memory"], [
            [name, f"{row.seconds:.0f} s", f"{row.allowed} s", f"{row.peak_gib:.2f} GiB"]
            for name, row in speed.stage.items()]), f"""
        After a mask edit of {part.edited_texels} x {part.edited_texels} texels in the finished scan, {part.rows} x
        {part.columns} texels were solved again in {part.seconds} s, {part.seconds_with_loading} s with loading
        (allowed: 25).

        Low memory takes a third off the peak, not half: what a single layer works on, the network's input and the
        evidence at full size stay. [Costs](costs.md) has a processor without bfloat16; a GPU was not at hand. The work
        is not cropped to the box of what was seen: our UV square is nearly filled by it. A draft's normals and specular
        are those the prior expects of its albedo, in one evaluation (`tests/test_draft.py` holds it to less error than
        the closed form leaves).
        """))]
