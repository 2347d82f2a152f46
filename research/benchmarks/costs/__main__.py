# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run `chain`, or one `stage` in this process: only that module is loaded, so no other library counts as its memory."""

from __future__ import annotations

import argparse
import sys
from importlib import import_module

from .. import costs

COMMANDS = ("chain", "stage")


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
