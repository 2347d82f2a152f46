# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/photographs.md: the delighter on single photographs."""

from ..delighting.photographs import COLUMNS, TITLES, WORDS
from ..figures import Figures
from ..measures.table import format_table, summarise
from ..pages import Sections

TITLE = "Single photographs: the face that is kept and the light that is left"
SAYS = "Real people under many lights, beside answers that do nothing, give one colour, or know the light."
RECORDS = ("photographs",)


def sections(record: Figures) -> Sections:
    return [
        ("", WORDS),
        *(
            (title, format_table(summarise(record[name].people, COLUMNS), COLUMNS, "answer"))
            for name, title in TITLES.items()
            if name in record
        ),
    ]
