# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What went wrong last, and what to do about it: kept per capture until something works, shown under the next step."""

from ..core.messages import Problem

_problems: dict[str, Problem] = {}  # capture folder ('' for none) -> its last problem


def show(root: str, problem: Problem) -> None:
    _problems[root] = problem


def clear(root: str) -> None:
    _problems.pop(root, None)


def of(root: str) -> Problem | None:
    return _problems.get(root)


def draw(layout, problem: Problem | None, width: int) -> None:
    """Problem and remedy, wrapped to a region `width` pixels wide."""
    if problem is None:
        return
    box = layout.box()
    box.alert = True
    for i, line in enumerate(wrapped(problem.problem, width)):
        box.label(text=line, icon='ERROR' if i == 0 else 'BLANK1')
    box.alert = False
    for i, line in enumerate(wrapped(problem.remedy, width)):
        box.label(text=line, icon='INFO' if i == 0 else 'BLANK1')


def wrapped(text: str, width: int) -> list[str]:
    """Lines that fit a panel `width` pixels wide; long words (paths) are broken, nothing is cut."""
    import textwrap

    return textwrap.wrap(text, max(20, (width - 60) // 7)) or [""]
