# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/photographs.md: the delighter on single photographs."""

from ..delighting.photographs import COLUMNS, TITLES
from ..figures import Figures
from ..measures.table import format_table, summarise
from ..pages import Sections, prose

TITLE = "Single photographs: the face that is kept and the light that is left"
SAYS = "Real people under many lights, beside answers that do nothing, give one colour, or know the light."
RECORDS = ("photographs",)


def sections(record: Figures) -> Sections:
    words = """
        PSNR is after one gain per channel; *detail* is the correlation with the truth's log green between 1 and 3 px.
        *Brows, eyes, lips, chin*: kept share of the truth's contrast, median over the lights. *Mean abs(1 - kept)*: of
        brows and eyes, each picture apart. *Between lights*: deviation of the kept share between the lights, over that
        of the untouched photographs. *Agreement*: PSNR of the mean squared difference between the answers to two
        lights, each pair at the truth's tone. *Slopes*: how far the answer follows a change of the light alone, and of
        the pigment alone. ± is the spread over people; for pairs, over groups of skin tone.
        """
    tables = [
        (title, format_table(summarise(record[name].people, COLUMNS), COLUMNS, "answer"))
        for name, title in TITLES.items()
        if name in record
    ]
    return [("", prose(words)), *tables]
