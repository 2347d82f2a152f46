# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/eyes.md: open eyes found in frames, against the true ones."""

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
    alone = {name: row for name, row in rows.items() if name.endswith(ALONE)}
    groups = {"true heads, fitted": fitted, "true heads, by the head alone": alone, "filmed": filmed}
    single = [[name, *(number(row[column], 2) for column in COLUMNS)] for name, row in {**fitted, **filmed}.items()]
    words = """
        Synthetic people with open eyes, by the eye reader (`core/face/eye_reader.py`) and the fit of
        `core/stages/registration/lid_marks.py`. *True heads*: six people in ten frames with true cameras, whose eyes
        are fitted to their own heads, half a millimetre off. *By the head alone*: the eyes of such a head without any
        frame. They are nearly right because these people's lids are the template's own and open as it opens them; real
        lids are not, so this row is no bound. It shows the cost of following the frames where nothing is to be
        followed. *Filmed*: people whose head also comes from their film. Their rims are worst at the eyes' corners,
        where the opening is thinner than the reader resolves. Irises of true heads are measured over their true skin (a
        dash: not measured), those of filmed people over the solved skin; both eyes have one colour, so a person's two
        figures are alike. Since then irises are measured over the white as well, and no longer follow the skin's tone
        ([at a wrong tone](wrong_tones.md)).
        """
    means = markdown(["mean over eyes", *COLUMNS[:7]], [[name, *_means(group)] for name, group in groups.items()])
    return [
        ("", prose(words, means, *filter(None, [left_out(rows)]))),
        ("Eye by eye", markdown(["eye", *COLUMNS], single)),
    ]


def left_out(rows: dict) -> str:
    """Return the people who are not in the means: open eyes taken for closed, and those not in the record."""
    opened = [person.name for person in LIKENESSES if sample_person(person.seed).openness]
    groups = {
        "Taken for closed, and in no mean": [
            name for name in opened if rows.get(f"{name}, left", {}).get("rim, mm", 0) is None
        ],
        "Also filmed with open eyes, but not measured": [name for name in opened if f"{name}, left" not in rows],
    }
    return " ".join(f"{words}: {', '.join(names)}." for words, names in groups.items() if names)


def _means(rows: dict) -> list[str | None]:
    """Return mean ± deviation over eyes of the measured columns."""
    values = [[row[column] for row in rows.values() if row[column] is not None] for column in COLUMNS[:7]]
    return [f"{np.mean(v):.2f} ± {np.std(v, ddof=1):.2f}" if len(v) > 1 else None for v in values]
