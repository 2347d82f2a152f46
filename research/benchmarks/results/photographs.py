# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/photographs.md: the delighter on single photographs."""

from ..delighting.photographs import COLUMNS, TITLES
from ..delighting.real_people import COLUMNS as COLUMNS_RELIT
from ..figures import Figures
from ..measures.table import format_table, summarise
from ..pages import Sections, prose

TITLE = "Single photographs: the face that is kept and the light that is left"
SAYS = "Real people under many lights, beside answers that do nothing, give one colour, or know the light."
RECORDS = ("photographs", "real_people")


def sections(record: Figures, relit: Figures) -> Sections:
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
    return [("", prose(words)), *tables, ("Twelve real people, relit", _relit(relit))]


def _relit(record: Figures) -> str:
    words = """
        People of the Face Research Lab London Set on whom nothing is trained, without the studio's light, under lamps
        and panoramas that no training has; two sights each, two lights a sight. Natural log, root mean square over the
        face after one gain per channel: the *error* of the log-albedo, its part *finer* than an eighth of the face,
        and the disagreement *between* the *lights*; each at the contrast that suits the answer best, in brackets as it
        is. ± is the spread over people.
        """
    rows = ["| answer | error | finer | between lights |", "| --- | --- | --- | --- |"]
    for answer, figures in record.items():
        columns = (figures[column] for column in COLUMNS_RELIT)
        cells = [f"{c.best:.3f} ± {c.deviation:.3f} ({c.value:.3f})" for c in columns]
        rows.append(f"| {' | '.join([answer, *cells])} |")
    return prose(words) + "\n\n" + "\n".join(rows)
