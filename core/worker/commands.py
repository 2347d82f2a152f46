# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Definition of the commands of `python -m core`. Standard library only."""

from __future__ import annotations

import argparse
import os
import shlex
from collections.abc import Callable
from pathlib import Path

from ..capture.messages import Problem


def path_of(text: str) -> Path:
    """Return the path of an argument; ~ is a home even where quotes kept the shell from it."""
    return Path(os.path.expanduser(text))


def add_command(
    commands, name: str, carry_out: Callable[[argparse.Namespace], int], help: str, *paths: str
) -> argparse.ArgumentParser:
    """Add `name PATH ...` to subparsers and return its parser.

    `paths` are written in capitals, as in the help; `carry_out` gets them as options in small letters, and returns the
    exit code.
    """
    parser = commands.add_parser(name, help=help)
    for path in paths:
        parser.add_argument(path.lower(), metavar=path, type=path_of)
    parser.set_defaults(command=carry_out)
    return parser


def refuse_exchanged(folder: Path, file: Path, command: str) -> None:
    """Raise Problem if a command's folder is a file and its file a folder; `command` is what comes before both."""
    if folder.is_file() and file.is_dir():
        raise Problem(
            f"The arguments are exchanged: {folder} is a file, and {file} the folder.",
            f"Write `python -m core {command} {shlex.join([str(file), str(folder)])}`.",
        )
