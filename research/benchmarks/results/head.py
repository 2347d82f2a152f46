# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/head.md: the sample head close up, and beside the frame it was filmed in."""

from __future__ import annotations

from ..figures import Figures
from ..head_closeups import to_table
from ..pages import Sections, prose

TITLE = "What a head looks like"
SAYS = "The sample head close up in both engines, beside that of 0.1.0, and beside the frame it was filmed in."
RECORDS = ("head_closeups",)
PICTURED = "The frame, the true skin, today's maps on the true head, today's head, that of 0.1.0; FLIP's maps"


def sections(found: Figures) -> Sections:
    took = (
        f" A picture of today's at 1,024 pixels and 128 samples takes Cycles {found.seconds:.0f} s on the machine"
        " above, with Blender's start."
        if "seconds" in found
        else ""
    )
    return [
        (
            "",
            prose(f"""
        Both heads are the shipped ones, as *Open Sample Head* brings them in, each in its own version's material and
        light; no hair was grown and no eyes were added. Shown by Blender's view transform Standard.{took}
        """),
        ),
        (
            "Close up",
            prose("""
        ![Brow, nose, mouth, ear and neck under three lights](../pictures/head_closeups.jpg)

        *Three Point, Overcast and Sun, from left to right; under each 0.1.0 in Cycles and EEVEE, then today's in both.*

        0.1.0's neck ends in a ragged line, today's in a clean one; the highlight on today's forehead is wider and
        softer. In EEVEE a pale line runs around the nostrils and within the ears, in both versions.
        """),
        ),
        (
            "Beside the frame",
            prose(
                f"""
        Frame {found.frame} of the sample video, from the front; then in the same scene, from the same camera and under
        the same sun behind leaves the true skin on the true head, rendered anew, today's maps on the true head, and
        both solved heads with their maps, laid over the true one by ICP of their faces. The scene's own material is
        taken, which has no light below the skin, as the frame's has none. Over the face, after one gain per channel;
        below, FLIP's maps. What the true skin misses is the film's noise and compression, and Cycles's.
        """,
                to_table(found.rows),
                """
        What is missing is shape as much as colour: on the true head the same maps come nearer. FLIP's lines lie under
        the nose, on the lower lids, under the lower lip and at the chin, where the registered head is off ([how
        far](geometry.md)) and shadows fall elsewhere; 0.1.0's head has the same lines, and so nearly the same figures.
        Lips are too pale on either head. No leaf's shadow is left in either albedo.
        """,
                f"![{PICTURED}](../pictures/head_frame.jpg)",
            ),
        ),
    ]
