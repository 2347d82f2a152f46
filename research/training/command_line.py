# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line of the trainings: the options that all of them have, and what is done with them."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

from core.capture.messages import Log, Reporter

from .descent import TrainingRun


def make_parser(training: str, description: str, configs: dict, out: Path) -> argparse.ArgumentParser:
    """The options of every training.

    Parameters
    ----------
    training : its name in `python -m research.training NAME`
    description : of --help
    configs : by name, of which --config chooses
    out : where its weights go by default
    """
    options = argparse.ArgumentParser(
        f"python -m research.training {training}",
        description=description,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    options.add_argument("--config", default="cpu", choices=tuple(configs))
    options.add_argument(
        "--minutes", type=float, help="in all, those of earlier runs included; the configuration's by default"
    )
    options.add_argument(
        "--export", action="store_true", help="write the weights of the work folder's last checkpoint and stop"
    )
    options.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / f"wildcap_{training}")
    options.add_argument("--out", type=Path, default=out)
    return options


def add_skins(options: argparse.ArgumentParser) -> None:
    """The options of a training that can learn from skins of other heads."""
    options.add_argument("--skins", type=Path, metavar="FOLDER", help="skins that `train carry` brought into our UVs")
    options.add_argument(
        "--held-out",
        nargs="+",
        default=[],
        metavar="NAME",
        help="skins of FOLDER that are kept from training, each with its cluster",
    )


def add_sights(options: argparse.ArgumentParser, sight_kind: str) -> None:
    """The options of a training on sights that are made first: `sight_kind` names them, in the plural."""
    options.add_argument(
        "--hdri", type=Path, metavar="FOLDER", help="panoramas whose licence lets weights trained with them be shipped"
    )
    options.add_argument("--growing", action="store_true", help=f"train on the {sight_kind} that are there already")
    options.add_argument("--prepare", action="store_true", help=f"make the {sight_kind} and stop")


def carry_out(
    options: argparse.ArgumentParser,
    arguments: list[str] | None,
    train: Callable[..., dict],
    export: Callable[[Path, Path], dict],
    prepare: Callable[[str, Path, Reporter], None] | None = None,
) -> int:
    """Trains, or exports an earlier training.

    Parameters
    ----------
    options : of the training
    arguments : of the command line; None: this process's
    train : takes by keyword the run, the report and those options that no TrainingRun has
    export : (work folder, out) -> card
    prepare : (configuration, work folder, report) answers to --prepare, where a training has that option

    Returns
    -------
    The exit code.
    """
    flags = vars(options.parse_args(arguments))
    report = Reporter(
        "train", emit=lambda message: print(message.text, flush=True) if isinstance(message, Log) else None
    )
    exports, prepares = flags.pop("export"), flags.pop("prepare", False)
    if exports:
        export(flags["work"], flags["out"])
    elif prepares:
        prepare(flags["config"], flags["work"], report)
    else:
        run = TrainingRun(**{field.name: flags.pop(field.name) for field in fields(TrainingRun) if field.name in flags})
        train(report=report, run=run, **flags)
    return 0
