# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Subcommands run and solve, executed by the solver of this Blender's preferences."""

import argparse
import subprocess
from pathlib import Path

from .. import jobs, preferences
from ..terminal import Command


def _run(arguments) -> int:
    source = arguments.source if arguments.source == "-" else Path(arguments.source).absolute()
    return _core("run", source, Path(arguments.capture).absolute(), *arguments.options)


def _solve(arguments) -> int:
    return _core("run", "-", Path(arguments.capture).absolute(), "--from", "solve", *arguments.options)


def _core(*words: str | Path) -> int:
    """Run the solver's command line, and return its exit code. Raises Problem if no solver is set up."""
    return subprocess.run([str(preferences.require_python()), "-E", "-s", str(jobs.ROOT), *map(str, words)]).returncode


def _of_run(kind) -> None:
    kind.add_argument(
        "source", help="a video, a photograph, or a folder of photographs; - for the one the capture was made from"
    )
    _of_solve(kind)


def _of_solve(kind) -> None:
    kind.add_argument("capture", help="the face's folder, usually NAME.wildcap")
    kind.add_argument(
        "options", nargs=argparse.REMAINDER, help="see `python -m core run --help`; for example --quality film"
    )


COMMANDS = (
    Command(
        "run", "from a video or photographs to the maps; a second run continues where the first stopped", _of_run, _run
    ),
    Command("solve", "the maps again, from the texture and the mask", _of_solve, _solve),
)
