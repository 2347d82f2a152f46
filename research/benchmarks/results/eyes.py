# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/eyes.md: open eyes that were found in frames, against the true ones."""

import numpy as np

from ...people.lifelike.person import sample_person
from ..captures.likenesses import LIKENESSES
from ..figures import Figures, markdown, number
from ..head.open_eyes import ALONE, COLUMNS
from ..pages import Sections, prose

TITLE = "Open eyes"
SAYS = "Edges of the lids, eyeballs, gaze and irises, against people whose eyes are known."
RECORDS = ("open_eyes",)


def sections(record: Figures) -> Sections:
    rows = record.rows
    filmed = {name: row for name, row in rows.items() if not name[0].isdigit()}
    fitted = {name: row for name, row in rows.items() if name[0].isdigit() and not name.endswith(ALONE)}
    still = {name: row for name, row in rows.items() if name.endswith(ALONE)}
    table = [
        ["true heads, fitted", *_means(fitted)],
        ["true heads, by the head alone", *_means(still)],
        ["filmed", *_means(filmed)],
    ]
    return [
        (
            "",
            prose(
                """
        Synthetic people with open eyes, by the eye reader (`core/face/eye_reader.py`) and the fit of
        `core/stages/registration/lid_marks.py`. *True heads*: six people in ten frames with true cameras, whose eyes
        are fitted to their own heads, half a millimetre off. *By the head alone* is what such a head says of its eyes
        when no frame is asked: next to nothing is wrong there, since these people's lids are the template's own and
        open as it opens them. Real lids are not, so that row is no bound: it says what following the frames costs where
        there is nothing to follow. *Filmed* are people whose head came from their film, too: their rims are worst at
        the eyes' corners, where the opening is thinner than the reader tells. Irises of true heads are measured over
        their true skin (a dash: not measured), those of filmed people over the skin that the solve found; both eyes
        have one colour, so that a person's two figures are alike.
        """,
                markdown(["mean over eyes", *COLUMNS[:7]], table),
                *filter(None, [left_out(rows)]),
            ),
        ),
        (
            "Eye by eye",
            markdown(
                ["eye", *COLUMNS],
                [[name, *(number(row[column], 2) for column in COLUMNS)] for name, row in {**fitted, **filmed}.items()],
            ),
        ),
    ]


def left_out(rows: dict) -> str:
    """Who is not in the means: people whose open eyes were taken for closed, and those who are not in the record."""
    opened = [person.name for person in LIKENESSES if sample_person(person.seed).openness]
    taken = [name for name in opened if rows.get(f"{name}, left", {}).get("rim, mm", 0) is None]
    absent = [name for name in opened if f"{name}, left" not in rows]
    return " ".join(
        f"{words}: {', '.join(names)}."
        for words, names in (
            ("Taken for closed, and in no mean", taken),
            ("Filmed with open eyes, too, and not measured", absent),
        )
        if names
    )


def _means(rows: dict) -> list[str | None]:
    """Mean ± deviation over eyes of the measured columns."""
    told = []
    for column in COLUMNS[:7]:
        values = [row[column] for row in rows.values() if row[column] is not None]
        told.append(f"{np.mean(values):.2f} ± {np.std(values, ddof=1):.2f}" if len(values) > 1 else None)
    return told
