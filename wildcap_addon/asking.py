# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a dialog has to say and takes seconds to find out (how much to download, what is deleted): found in the
background, then the dialog opens."""

from collections.abc import Callable

import bpy

from ..core.worker.background import BackgroundTask
from . import jobs

_answers: dict[tuple, object] = {}


def answer(key: tuple):
    """What was found for a question; None: not asked yet."""
    return _answers.get(key)


def forget(key: tuple) -> None:
    _answers.pop(key, None)


def find_answer(
    key: tuple, work: Callable[[BackgroundTask], object], operator: str, meant: Callable[[], bool] = lambda: True
) -> None:
    """Runs a job that the tab shows and that finds an answer; then the operator's dialog opens as if it were clicked
    again.

    Parameters
    ----------
    key : the question's, as `answer` takes it
    work : work(task) finds the answer, in a thread
    operator : its name after "wildcap."
    meant : whether the artist still means it when the answer is there; else no dialog opens
    """
    task = BackgroundTask("setup", work)

    def then() -> None:
        _answers[key] = task.result
        _click(operator, meant)

    jobs.start_worker("", "ask", task, then)


def _click(operator: str, meant: Callable[[], bool]) -> None:
    """Opens the operator's dialog where it is allowed and meant; not under an artist who is in the middle of something:
    then the next click shows it at once."""
    windows = [] if bpy.app.background else bpy.context.window_manager.windows
    if windows and not any(window.modal_operators for window in windows):
        with bpy.context.temp_override(window=windows[0]):
            dialog = getattr(bpy.ops.wildcap, operator)
            if meant() and dialog.poll():
                dialog('INVOKE_DEFAULT')
