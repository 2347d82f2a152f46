# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Train a network, or make what a training needs: `python -m research.training NAME ...`; each NAME has --help.

Needs neither Blender nor the internet. The training of a network stops after --minutes; a second run continues where
the first was killed, --prepare makes the training data alone, and --export writes the weights of the last checkpoint.
"""

from __future__ import annotations

import argparse
import sys
from importlib import import_module

from core.capture.messages import Problem

from .networks import run_command

NETWORKS = ("delighter", "eyes", "parser", "prior", "upscaler")
OTHERS = ("carry", "glasses", "irises", "tones", "traits")


def main(arguments: list[str]) -> int:
    """Run one training. Returns its exit code, 2 for a problem."""
    parser = argparse.ArgumentParser("python -m research.training", description=__doc__)
    parser.add_argument("name", choices=(*NETWORKS, *OTHERS))
    parser.add_argument("options", nargs=argparse.REMAINDER, help="of this training")
    chosen = parser.parse_args(arguments)
    module = import_module(f"{__package__}.{chosen.name}")
    try:
        if chosen.name in NETWORKS:
            run_command(module.TRAINING, module.__doc__, chosen.options)
        else:
            module.main(chosen.options)
    except Problem as problem:
        print(problem.problem, problem.remedy, sep="\n", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
