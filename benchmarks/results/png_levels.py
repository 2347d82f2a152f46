# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/png_levels.md: what a PNG costs."""

from __future__ import annotations

from ..figures import Figures
from ..pages import Sections, prose
from ..png_levels import table

TITLE = "What a PNG costs"
SAYS = "Seconds and megabytes by libpng's filter and zlib's level, and what we write."
RECORDS = ("png_levels",)


def sections(levels: Figures) -> Sections:
    chosen, up = levels.albedo["chosen 3"], levels.albedo["up 1"]
    return [
        (
            "",
            prose(
                f"""
        Seconds of the processor and megabytes of the sample's own pictures, by libpng's filter and zlib's level;
        *chosen* is libpng's own choice of a filter for each row. Written is *up* at level 1 (`images.QUICK`):
        {chosen.seconds / up.seconds:.1f} times as fast as *chosen* at level 3 for the albedo at 4096, which becomes
        {up.mb / chosen.mb:.2f} times as large. Maps that are shipped are packed at level 9.
        """,
                table(levels),
            ),
        )
    ]
