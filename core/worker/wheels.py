# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A folder of wheels from which the solver is installed without a network: all of a lock, PyTorch's build for the
device, and pip itself.

Standard library only. It is made on any machine that has a network, for any platform and Python that there is a lock
for.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from ..capture.messages import Problem
from . import locks, pip_steps


def download(
    requirements: Path, name: str, compute: str, source: str, folder: Path, run: Callable[[list], tuple[int, str]]
) -> list[Path]:
    """Brings the wheels of a lock into a folder. Those that are there already stay.

    Parameters
    ----------
    requirements : the folder of requirements and locks
    name : of the lock
    compute : 'cpu', 'cuda' or 'apple'
    source : 'pytorch' or 'pip', as in pip_steps.SOURCES
    folder : for the wheels
    run : runs a command; its exit code and last error

    Returns
    -------
    All wheels of the folder.

    Raises
    ------
    Problem
        Where the folder is none, or a wheel cannot be had.
    """
    lock = locks.read(requirements, name)
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise Problem(f"{folder} is not a folder.", "Choose a folder for the wheels.")
    # -P and not -I: this Python's pip may be the user's own, but is not what lies in the working directory
    pip = [
        sys.executable,
        "-P",
        "-m",
        "pip",
        "download",
        "--disable-pip-version-check",
        "--no-input",
        "--progress-bar",
        "off",
        "--dest",
        folder,
        *tags(name),
    ]
    with tempfile.TemporaryDirectory(prefix="wildcap_wheels_") as scratch:
        own_pip = pip_steps.PipStep(
            ("--no-deps", "--require-hashes", "-r", str(Path(requirements) / "locks" / "pip.txt"))
        )
        steps = [*pip_steps.plan_steps(requirements, lock, compute, source, Path(scratch)), own_pip]
        code, error = pip_steps.carry_out(steps, lambda words: run([*pip, *words]))
    if code:
        raise Problem(
            f"Not all wheels for {name} could be downloaded "
            f"({error.removeprefix('ERROR: ').rstrip('.') or 'no message'}).",
            "Check the network connection and run the command again: it continues.",
        )
    return sorted(folder.glob("*.whl"))


def tags(name: str) -> list[str]:
    """pip's options for the wheels of a lock's platform and Python."""
    platform, _, python = name.rpartition("-")
    return [
        "--only-binary",
        ":all:",
        "--implementation",
        "cp",
        "--python-version",
        python,
        *(word for tag in locks.PLATFORMS[platform] for word in ("--platform", tag)),
    ]
