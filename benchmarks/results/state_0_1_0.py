# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/state_0_1_0.md: the same captures, heads and measures by version 0.1.0."""

from __future__ import annotations

from .. import state
from ..figures import Figures
from ..measures.table import Scores, format_table, summarise
from ..pages import Sections, prose
from ..state_captures import DELIT, SOLVED

TITLE = "The state of version 0.1.0"
SAYS = "The same captures, heads and measures by the delighter and the solver of 0.1.0, and what has changed since."
RECORDS = ("state_0_1_0", "state")
COMPARED = {
    name: state.TABLES[table][name]
    for table, names in (
        ("In the picture", ("psnr", "ssim", "flip", "detail", "shadow_step")),
        ("Up to a light, and across lights", ("psnr_shared", "agreement")),
        ("Features kept", ("lost",)),
    )
    for name in names
}


def sections(before: Figures, now: Figures) -> Sections:
    return [
        (
            "",
            prose(f"""
        `python -m benchmarks.earlier` took the captures of [the state](state.md) through 0.1.0's own code and weights,
        from the delighter on; frames, cameras and heads are today's. {left_out(before, now)} The tables below the first
        are those of that page.
        """),
        ),
        ("What has changed", changes(before, now)),
        *((title or "By 0.1.0 alone", text) for title, text in state.sections(before.people, before.captures)),
    ]


def left_out(before: Figures, now: Figures) -> str:
    """Which captures of today's page 0.1.0 was not measured on."""
    missing = [name for name in now.captures if name not in before.captures]
    return f"Not taken through it were {', '.join(missing)}." if missing else "None was left out."


def changes(before: Figures, now: Figures) -> str:
    """Today's texture and albedo less those of 0.1.0, person by person, on the captures that 0.1.0 was measured on."""
    return "\n\n".join(
        format_table(
            summarise(paired(before, now, method), COMPARED, f"{method}, 0.1.0"),
            COMPARED,
            "taken for albedo",
            f"{method}, 0.1.0",
        )
        for method in (DELIT, SOLVED)
    )


def paired(before: Figures, now: Figures, method: str) -> Scores:
    """Method of then and of now -> person -> figures, of the same captures."""
    rows = {}
    for person, then in before.people[method].items():
        today = now.people[method].get(person, {})
        if then["captures"] == 1 != today.get("captures"):  # one capture shares its light with no other
            today = dict(now.captures.get(person, {}).get(method, {}))
            today |= {"captures": 1, "psnr_shared": today["psnr_alone"]} if today else {}
        if today.get("captures") == then["captures"]:
            rows[person] = then, today
    return {
        f"{method}, 0.1.0": {person: then for person, (then, _) in rows.items()},
        method: {person: today for person, (_, today) in rows.items()},
    }
