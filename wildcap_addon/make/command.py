# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The chain as words of the terminal: run and solve, by the solver that is set up in this Blender's preferences; its
own words come through."""

import argparse
import subprocess
from pathlib import Path

from ...core.capture.messages import Problem
from .. import jobs, preferences
from ..terminal import Command


def _run(arguments) -> int:
    source = arguments.source if arguments.source == "-" else Path(arguments.source).absolute()
    return _core("run", source, Path(arguments.capture).absolute(), *arguments.options)


def _solve(arguments) -> int:
    return _core("run", "-", Path(arguments.capture).absolute(), "--from", "solve", *arguments.options)


def _core(*words: str | Path) -> int:
    """The solver's own command line, in the folder that Blender was called in, from which paths are told; returns its
    exit code. Raises Problem where no solver is set up."""
    python = preferences.python()
    if python is None:
        raise Problem(
            "The solver is not set up on this machine.",
            "Click Install Solver in the Setup panel of Blender's window, once.",
        )
    return subprocess.run([str(python), "-E", "-s", str(jobs.ROOT), *map(str, words)]).returncode


def _of_run(kind) -> None:
    kind.add_argument("source", help="a video, or a folder of photographs; - for the one the capture was made from")
    _of_solve(kind)


def _of_solve(kind) -> None:
    kind.add_argument("capture", help="the face's folder, usually NAME.wildcap")
    kind.add_argument(
        "options", nargs=argparse.REMAINDER, help="as `python -m core run --help` tells them, --quality film among them"
    )


COMMANDS = (
    Command(
        "run", "from a video or photographs to the maps; a second run continues where the first stopped", _of_run, _run
    ),
    Command("solve", "the maps again, from the texture and the mask", _of_solve, _solve),
)
