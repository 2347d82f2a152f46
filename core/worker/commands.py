# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Definition of the commands of `python -m core`. Standard library only."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path


def add_command(
    commands, name: str, carry_out: Callable[[argparse.Namespace], int], help: str, *paths: str
) -> argparse.ArgumentParser:
    """Add `name PATH ...` to subparsers and return its parser.

    `paths` are written in capitals, as in the help; `carry_out` gets them as options in small letters, and returns the
    exit code.
    """
    parser = commands.add_parser(name, help=help)
    for path in paths:
        parser.add_argument(path.lower(), metavar=path, type=Path)
    parser.set_defaults(command=carry_out)
    return parser
