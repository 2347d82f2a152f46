# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A folder of wheels to install the solver from without a network: a lock, PyTorch's build for the device, and pip.

It can be made on any machine, for any platform and Python with a lock. Standard library only.
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
    """Download the wheels of the lock `name` for a device into a folder, and return all wheels in it.

    `source` is "pytorch" or "pip", as in pip_steps.SOURCES; `run` runs a command and returns its exit code and last
    error. Raises Problem if the folder is a file or a wheel is missing.
    """
    lock = locks.read(requirements, name)
    if folder.exists() and not folder.is_dir():
        raise Problem(f"{folder} is not a folder.", "Choose a folder for the wheels.")
    # -P, not -I: this pip may be the user's own, but not one in the working directory
    options = ("--disable-pip-version-check", "--no-input", "--progress-bar", "off")
    pip = [sys.executable, "-P", "-m", "pip", "download", *options, "--dest", folder, *tags(name)]
    with tempfile.TemporaryDirectory(prefix="wildcap_wheels_") as scratch:
        own_pip = pip_steps.PipStep(("--no-deps", "--require-hashes", "-r", str(requirements / "locks" / "pip.txt")))
        steps = [*pip_steps.plan_steps(requirements, lock, compute, source, Path(scratch)), own_pip]
        code, error = pip_steps.carry_out(steps, lambda words: run([*pip, *words]))
    if code:
        raise Problem(
            f"Not all wheels for {name} could be downloaded ({pip_steps.shorten(error)}).",
            "Check the network connection and run the command again: it continues.",
        )
    return sorted(folder.glob("*.whl"))


def tags(name: str) -> list[str]:
    """Return pip's options for the wheels of a lock's platform and Python."""
    platform, _, python = name.rpartition("-")
    platforms = [word for tag in locks.PLATFORMS[platform] for word in ("--platform", tag)]
    return ["--only-binary", ":all:", "--implementation", "cp", "--python-version", python, *platforms]
