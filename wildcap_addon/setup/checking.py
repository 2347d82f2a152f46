# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Background checks of the solver's Python: at Blender's start, and with all packages loaded after a new choice.

One that fails is set aside, and the tab shows the first steps again.
"""

from pathlib import Path

import bpy

from ...core.capture.messages import Problem
from ...core.worker import environment
from ...core.worker.background import BackgroundTask
from .. import jobs, preferences, problems, status

REQUIREMENTS = jobs.ROOT / "requirements"
FIRST_S, INTERVAL_S = 2.0, 0.5
_checks: list[BackgroundTask] = []  # the running or finished one, if any


def judge(python: Path, importing: bool) -> tuple[str, str]:
    """Return the device that a Python computes on, and why; '' without `importing` its packages.

    Raises Problem if it cannot run the solver.
    """
    probe = environment.survey(python, REQUIREMENTS, importing)
    faults = environment.judge(probe, REQUIREMENTS)
    if faults:
        raise Problem(
            f"{python} cannot run the solver. {' '.join(faults[:3])}",
            f"Install what {REQUIREMENTS / 'worker.txt'} lists; or click Install Solver, which brings it up to date.",
        )
    return (probe["device"], probe["reason"]) if importing else ("", "")


def accept(python: Path) -> None:
    """Make it the solver's Python, and examine it more closely in the background."""
    preferences.set_python(python)
    _checks.clear()
    if not bpy.app.timers.is_registered(look):
        bpy.app.timers.register(look, first_interval=INTERVAL_S, persistent=True)


def look() -> float | None:
    """Start the check, and process its result. The timer's function."""
    python = preferences.python()
    if python is None:
        return None
    if not _checks:
        _checks.append(BackgroundTask("setup", lambda task: judge(python, importing=not preferences.get().device)))
        _checks[0].start()
    for message in _checks[0].poll():
        if hasattr(message, "problem"):
            preferences.set_aside(python)
            problems.show("", Problem(message.problem, message.remedy))
        elif _checks[0].result and _checks[0].result[0]:
            preferences.set_python(python, *_checks[0].result)
        status.redraw()
    return INTERVAL_S if _checks[0].running else None


def register():
    bpy.app.timers.register(look, first_interval=FIRST_S, persistent=True)


def unregister():
    if bpy.app.timers.is_registered(look):
        bpy.app.timers.unregister(look)
    for task in _checks:
        task.terminate()
    _checks.clear()
