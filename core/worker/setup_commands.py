# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that set a machine up: python -m core install and wheels.

Standard library only: the Python that runs them has no packages yet.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from ..capture.messages import Done, Failed, Problem, Progress
from . import index, installation, locks, wheels
from .background import BackgroundTask
from .commands import add_command, path_of
from .environment import answer, python_of

REQUIREMENTS = Path(__file__).resolve().parents[2] / "requirements"
POLL_S = 0.1  # between two looks at the installation


def add_commands(commands) -> None:
    """Add the commands to the subparsers of `python -m core`."""
    install = add_command(commands, "install", _install, "make the solver's environment from this Python")
    install.add_argument("folder", metavar="FOLDER", type=path_of, help="new, empty, or one of an earlier installation")
    install.add_argument("--wheels", metavar="FOLDER", type=path_of, help="install from a folder of wheels, offline")
    _add_build(install)
    bring = add_command(commands, "wheels", _wheels, "download all wheels to install from offline", "FOLDER")
    names = f"{', '.join(locks.names())}; by default this machine and Python"
    bring.add_argument("--for", dest="name", choices=locks.names(), metavar="PLATFORM-PYTHON", help=names)
    _add_build(bring)


def _add_build(parser: argparse.ArgumentParser) -> None:
    computes = ("auto", "cpu", "cuda", "apple")
    parser.add_argument("--compute", choices=computes, default="auto", help="device that PyTorch is built for")
    words = "source of PyTorch: its own index where PyPI lacks the build, or the index that pip is configured for"
    parser.add_argument("--packages", choices=("pytorch", "pip"), default="pytorch", help=words)


def _install(options: argparse.Namespace) -> int:
    folder = options.folder.absolute()
    kind = "folder" if options.wheels else options.packages
    source = installation.PackageSource(options.compute, kind, options.wheels)
    log = folder.with_name(f"{folder.name}.wildcap-install.log")
    task = installation.installation(folder, REQUIREMENTS, log, Path(sys.executable), source)
    _follow(task)
    print(f"The solver is ready: {python_of(folder)}")
    return 0


def _wheels(options: argparse.Namespace) -> int:
    name = options.name or locks.lock_name(answer(sys.executable, locks.DESCRIBE))
    compute = "cpu" if options.compute == "auto" else options.compute
    if compute == ("cuda" if name.startswith("macosx") else "apple"):
        raise Problem(f"There is no solver for {compute} on {name}.", "Leave --compute out, or choose another.")

    def work(task: BackgroundTask):
        def run(command) -> tuple[int, str]:
            return task.run(command, lambda line: _hear(task, line))

        return wheels.download(REQUIREMENTS, name, compute, options.packages, options.folder, run)

    task = BackgroundTask("wheels", work)
    _follow(task)
    size = index.gigabytes(sum(path.stat().st_size for path in task.result))
    print(
        f"{len(task.result)} wheels for {name} in {options.folder}, {size}; "
        f"`python -m core install FOLDER --wheels {options.folder}` installs from them, and so does Install Solver"
    )
    return 0


def _hear(task: BackgroundTask, line: str) -> None:
    if line.startswith(("Collecting", "  Downloading", "Saved")):
        task.say(0, 1, line.strip().split(" (from")[0][:80])


def _follow(task: BackgroundTask) -> None:
    """Run a task to its end, with its progress on stderr. Raises Problem if it fails."""
    task.start()
    try:
        while task.running:
            for message in task.poll():
                if isinstance(message, Progress):
                    print(message.text, file=sys.stderr)
                elif isinstance(message, Failed):
                    raise Problem(message.problem, message.remedy)
                elif isinstance(message, Done):
                    print(f"{message.seconds:.0f} s", file=sys.stderr)
            time.sleep(POLL_S)
    except KeyboardInterrupt:
        task.cancel()
        raise
