# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/costs.md: time and memory of the chain, stage by stage."""

from __future__ import annotations

from ..costs import table
from ..figures import Figures
from ..pages import Sections, prose

TITLE = "Time and memory"
SAYS = "Seconds and peak memory of each stage at two qualities, and of an edited part."
RECORDS = ("costs", "edited_part")


def sections(costs: Figures, part: Figures) -> Sections:
    return [("The chain", chain(costs)), ("An edited part", edit(part))]


def chain(costs: Figures) -> str:
    return prose(
        f"""
        60 frames at standard quality take {costs.standard.together.minutes:.1f} minutes (asked for: 4), a draft
        {costs.draft.together.minutes:.1f}.

        The sample video on two cores, without a GPU. Each stage is run by a worker of its own: its seconds begin with
        starting Python and importing libraries, and its peak memory holds them. A draft shares the standard quality's
        frames and cameras, and its total counts them.
        """,
        table(costs),
        """
        The number of frames reaches frames and cameras alone: of more than 40 frames 40 carry the structure, and the
        others are placed by them; the scan takes 24 pairs of whatever there is, delight and texture the selected views.
        1024 is the largest side that can be chosen for the solve: the prior has seen nothing finer.
        """,
    )


def edit(part: Figures) -> str:
    return prose(f"""
        After a mask edit of {part.edited_texels} x {part.edited_texels} texels in the finished scan, {part.rows} x
        {part.columns} texels were solved again in {part.seconds} s, {part.seconds_with_loading} s with loading
        (allowed: 25).

        A GPU was not at hand. The work is not cropped to the box of what was seen: our UV square is nearly filled by
        it. A draft's normals and specular are those the prior expects
        of its albedo, in one evaluation (`tests/core/solver/test_draft.py` holds it to less error than the closed form
        leaves).
        """)
