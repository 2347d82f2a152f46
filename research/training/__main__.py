# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Train a network, or make what a training needs: `python -m research.training NAME ...`; each NAME has --help."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

from core.capture.messages import Problem

NAMES = sorted(
    path.stem for path in Path(__file__).parent.glob("*.py") if "\ndef main(" in path.read_text(encoding="utf-8")
)


def main(arguments: list[str]) -> int:
    """Run one training. Returns its exit code, 2 for a problem."""
    try:
        if arguments[:1] not in [[name] for name in NAMES]:
            raise Problem(
                f"Unknown training: {arguments[0]!r}." if arguments else "The name of the training is missing.",
                f"Choose one of {', '.join(NAMES)}.",
            )
        return import_module(f"{__package__}.{arguments[0]}").main(arguments[1:]) or 0
    except Problem as problem:
        print(problem.problem, problem.remedy, sep="\n", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
