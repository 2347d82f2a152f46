# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""python -m research.benchmarks.costs chain | solver | blender | acting | stage: one module each, loaded when it is
asked for, so that its libraries do not count as another's memory."""

from __future__ import annotations

import argparse
import sys
from importlib import import_module

from .. import costs

COMMANDS = ("chain", "solver", "blender", "acting", "stage")


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(
        prog="python -m research.benchmarks.costs",
        description=costs.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("command", choices=COMMANDS)
    command = parser.parse_args(arguments[:1]).command
    import_module(f"{__package__}.{command}").main(arguments[1:])


if __name__ == "__main__":
    main(sys.argv[1:])
