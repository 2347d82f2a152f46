# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Last problem of each capture and its remedy, shown under the next step until something succeeds."""

import textwrap

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..core.capture import unforeseen
from ..core.capture.messages import Problem


class Notice(Problem):
    """Result that the artist asked for, shown in the place of a problem."""


_problems: dict[str, Problem] = {}  # capture folder ('' for none) -> its last problem


def show(root: str, problem: Problem) -> None:
    _problems[root] = problem


def show_error(root: str, error: Exception, activity: str) -> None:
    """Show any error: a Problem as it is, others as an error inside WildCap that stopped something."""
    show(root, error if isinstance(error, Problem) else unforeseen.explain(error, activity))


def clear(root: str) -> None:
    _problems.pop(root, None)


def of(root: str) -> Problem | None:
    return _problems.get(root)


def draw(layout, problem: Problem | None, width: int) -> None:
    """Draw problem and remedy, wrapped to a region `width` pixels wide."""
    if problem is None:
        return
    box = layout.box()
    column = box.column()
    column.alert = not isinstance(problem, Notice)
    draw_text(column, problem.problem, width, 'ERROR' if column.alert else 'CHECKMARK')
    draw_text(box.column(), problem.remedy, width, 'INFO')
    if column.alert:
        box.operator("wildcap.save_report", icon='FILE_ARCHIVE')


def draw_text(layout, text: str, width: int, icon: str = 'NONE') -> None:
    """Draw an English text, translated as a whole, wrapped to a region `width` pixels wide."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    lines = wrapped(iface_(text), width - (45 if icon != 'NONE' else 0))
    for i, line in enumerate(lines):
        column.label(text=line, translate=False, icon=icon if i == 0 else 'BLANK1' if icon != 'NONE' else 'NONE')


def wrapped(text: str, width: int) -> list[str]:
    """Return lines that fit a panel `width` pixels wide; long words (paths) are broken, nothing is cut."""
    scale = bpy.context.preferences.system.ui_scale or 1.0  # 0 without a window
    return textwrap.wrap(text, max(20, int((width / scale - 50) / 6))) or [""]
