# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables with methods down, measures across: means over people, and paired differences from another method.

People differ far more than methods do: means of four to ten of them that differ by less than the spread may yet differ
for sure, and the paired differences tell. A cell holds only people who have that measure.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..figures import markdown

Scores = dict[str, dict[str, dict[str, float | None]]]
"""Method -> person -> measure -> figure; None or missing where it was not measured."""


@dataclass(frozen=True)
class Column:
    """A measure: heading with the unit, decimals, and the better direction: more (1), less (-1), neither (0)."""

    label: str
    digits: int = 2
    better: int = 1


@dataclass(frozen=True)
class Cell:
    """Mean and spread over people, paired difference from the compared method and its standard error, and count.

    spread is None for one person, difference and error for fewer than two.
    """

    mean: float
    spread: float | None
    difference: float | None
    error: float | None
    people: int


def summarise(scores: Scores, columns: dict[str, Column], against: str | None = None) -> dict[str, dict[str, Cell]]:
    """Return method -> measure -> Cell; differences are taken from the method `against`."""
    found: dict[str, dict[str, Cell]] = {}
    for method, people in scores.items():
        other = scores.get(against, {}) if against not in (None, method) else {}
        for measure in columns:
            values_by_person = {person: value for person, row in people.items() if _is_known(value := row.get(measure))}
            if not values_by_person:
                continue
            pairs = [
                value - theirs
                for person, value in values_by_person.items()
                if _is_known(theirs := other.get(person, {}).get(measure))
            ]
            values = list(values_by_person.values())
            found.setdefault(method, {})[measure] = Cell(
                float(np.mean(values)),
                _deviation(values),
                float(np.mean(pairs)) if pairs else None,
                standard_error(pairs),
                len(values),
            )
    return found


def standard_error(differences: list[float]) -> float | None:
    """Return the standard error of the mean of paired differences; None for fewer than two."""
    deviation = _deviation(differences)
    return None if deviation is None else deviation / math.sqrt(len(differences))


def format_table(
    summary: dict[str, dict[str, Cell]], columns: dict[str, Column], title: str, against: str | None = None
) -> str:
    """Return Markdown: a line per method, mean ± spread; with `against`, a second table of paired differences.

    A column that nobody has is left out.
    """
    shown = {name: column for name, column in columns.items() if any(name in row for row in summary.values())}
    tables = [
        markdown(
            [title, *(column.label for column in shown.values())],
            [
                [method, *(_mean_text(row.get(name), column) for name, column in shown.items())]
                for method, row in summary.items()
            ],
        )
    ]
    if against in summary:
        rows = [
            [method, *(_difference_text(row.get(name), column) for name, column in shown.items())]
            for method, row in summary.items()
            if method != against
        ]
        if any(cell is not None for row in rows for cell in row[1:]):
            heads = [f"less *{against}*, person by person", *(column.label for column in shown.values())]
            tables.append(markdown(heads, rows))
    return "\n\n".join(tables)


def to_record(summary: dict[str, dict[str, Cell]], scores: Scores) -> dict:
    """Return the input of figures.write_record: per method the cells, and every person's figures."""
    return {
        "summary": {
            method: {
                name: {key: value for key, value in vars(cell).items() if value is not None}
                for name, cell in row.items()
            }
            for method, row in summary.items()
        },
        "people": {
            method: {
                person: {name: value for name, value in row.items() if _is_known(value)}
                for person, row in people.items()
            }
            for method, people in scores.items()
        },
    }


def _mean_text(cell: Cell | None, column: Column) -> str | None:
    if cell is None:
        return None
    spread = "" if cell.spread is None else f" ± {cell.spread:.{column.digits}f}"
    return f"{round(cell.mean, column.digits) + 0.0:.{column.digits}f}" + spread


def _difference_text(cell: Cell | None, column: Column) -> str | None:
    """Return a cell, bold if better by more than two standard errors, italic if worse by as much."""
    if cell is None or cell.difference is None:
        return None
    error = "" if cell.error is None else f" ± {cell.error:.{column.digits}f}"
    text = f"{cell.difference:+.{column.digits}f}" + error
    if cell.error is None or not column.better or abs(cell.difference) <= 2 * cell.error:
        return text
    return f"**{text}**" if cell.difference * column.better > 0 else f"*{text}*"


def _deviation(scores: list[float]) -> float | None:
    return float(np.std(scores, ddof=1)) if len(scores) > 1 else None


def mean(values: list[float | None]) -> float | None:
    """Return the mean of the finite values, None if there are none."""
    finite = [value for value in values if _is_known(value)]
    return float(np.mean(finite)) if finite else None


def mean_of(rows: list[dict[str, float | None]]) -> dict[str, float | None]:
    """Return the mean of each figure over the rows that have it, None if none has."""
    return {name: mean([row.get(name) for row in rows]) for name in dict.fromkeys(name for row in rows for name in row)}


def _is_known(figure: float | None) -> bool:
    return figure is not None and math.isfinite(figure)
