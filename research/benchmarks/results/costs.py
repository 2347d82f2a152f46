# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/costs.md: time and memory of the chain, stage by stage, and what grows with what."""

from __future__ import annotations

from ..costs.rows import table
from ..figures import Figures
from ..pages import Sections, prose

TITLE = "Time and memory"
SAYS = (
    "Each stage's seconds and peak memory at three qualities, and how they grow with frames, views and texels; an "
    "edited part."
)
RECORDS = ("costs", "edited_part")


def sections(costs: Figures, part: Figures) -> Sections:
    return [("The chain", chain(costs)), ("An edited part", edit(part))]


def chain(costs: Figures) -> str:
    whole, here = costs.together, costs.machine
    return prose(
        f"""
        60 frames at standard quality take {whole.standard.minutes:.1f} minutes (asked for: 4), in float32
        {whole.float32.minutes:.1f} (6), 300 frames {whole["frames-300"].minutes:.1f} (7), 1,000 frames
        {whole["frames-1000"].minutes:.1f}, and {whole.float32.peak_mb / 1000:.1f} GB at most (3), by the solve in
        float32.

        The sample video on {here.cores} cores, without a GPU. Each stage runs in a process of its own; its seconds
        begin with importing its libraries, its peak memory holds them. Where other processes took more than 0.2 cores
        meanwhile the cell says so: its seconds are an upper bound. Frames and cameras of a draft have the standard's
        settings and are not measured twice. This processor ran the networks in {here.networks}; *float32* has solve and
        4K as a processor runs them that does not multiply bfloat16. frames-N is the whole chain on a film of so many
        frames.
        """,
        table(costs),
        f"""
        Of a texture above 1024, views are looked at and aligned on maps of 1024 and read along them one by one:
        {costs["texture-2048"].texture.peak_mb / 1000:.1f} GB at 2048. 1024 is the largest side that can be chosen for
        the solve: the prior has seen nothing finer, so 2048 says what it would cost, not that it would help. From 512
        the network makes a map of 2048, the rest is resampled. The number of frames reaches frames and cameras alone:
        of more than 40 frames 40 carry the structure, and the others are placed by them; the scan takes 24 pairs of
        whatever there is, delight and texture the views V. Exponents are fits of the logarithm of the processor's
        seconds to that of the size: for a side, 2 is linear in texels. *over*: the stage was ended after so long.
        """,
    )


def edit(part: Figures) -> str:
    return prose(f"""
        After a mask edit of {part.edited_texels} x {part.edited_texels} texels in the finished scan, {part.rows} x
        {part.columns} texels were solved again in {part.seconds} s, {part.seconds_with_loading} s with loading
        (allowed: 25).

        *float32* above is a processor without bfloat16; a GPU was not at hand. The work is not cropped to the box of
        what was seen: our UV square is nearly filled by it. A draft's normals and specular are those the prior expects
        of its albedo, in one evaluation (`tests/core/solver/test_draft.py` holds it to less error than the closed form
        leaves).
        """)
