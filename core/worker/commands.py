# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How a command of `python -m core` is added. Standard library only."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path


def add_command(
    commands, name: str, carry_out: Callable[[argparse.Namespace], int], help: str, *paths: str
) -> argparse.ArgumentParser:
    """Adds `name PATH ...` to subparsers.

    Parameters
    ----------
    commands : the subparsers
    name : of the command
    carry_out : takes the options, paths in small letters among them, and gives the exit code
    help : of the command
    paths : in capitals, as the help shows them

    Returns
    -------
    The parser, for what else the command has.
    """
    parser = commands.add_parser(name, help=help)
    for path in paths:
        parser.add_argument(path.lower(), metavar=path, type=Path)
    parser.set_defaults(command=carry_out)
    return parser
