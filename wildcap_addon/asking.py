# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Answers that a dialog needs before it opens and that take seconds to find, such as the size of a download."""

from collections.abc import Callable

import bpy

from ..core.worker.background import BackgroundTask
from . import jobs

_answers: dict[tuple, object] = {}


def answer(key: tuple):
    """Return the answer to a question, or None before it is known."""
    return _answers.get(key)


def forget(key: tuple) -> None:
    _answers.pop(key, None)


def find_answer(
    key: tuple,
    text: str,
    work: Callable[[BackgroundTask], object],
    operator: str,
    is_wanted: Callable[[], bool] = lambda: True,
):
    """Return the answer to a question; if it is unknown, None, and find it with `work(task)` in the background.

    Once the answer is there, the dialog of `wildcap.OPERATOR` opens if `is_wanted` still holds.
    """
    if key in _answers:
        return _answers[key]

    def then(result) -> None:
        _answers[key] = result
        _open(operator, is_wanted)

    run(text, work, then)
    return None


def run(text: str, work: Callable[[BackgroundTask], object], then: Callable[[object], None]) -> None:
    """Run `work(task)` in the background as a job that shows `text`; `then` gets its result."""

    def talk(task: BackgroundTask):
        task.say(0, 1, text)
        return work(task)

    task = BackgroundTask("setup", talk)
    jobs.start_worker("", "ask", task, lambda: then(task.result))


def _open(operator: str, is_wanted: Callable[[], bool]) -> None:
    """Open the operator's dialog, except during a modal operation: the next click then opens it at once."""
    windows = [] if bpy.app.background else bpy.context.window_manager.windows
    if windows and not any(window.modal_operators for window in windows):
        with bpy.context.temp_override(window=windows[0]):
            dialog = getattr(bpy.ops.wildcap, operator)
            if is_wanted() and dialog.poll():
                dialog('INVOKE_DEFAULT')
