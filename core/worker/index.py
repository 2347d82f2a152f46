# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Download, hosts and disk space of an installation, before anything is installed.

pip's dry run tells whether the index has everything: only pip knows which index this machine uses, and which build of
PyTorch it has. The locks tell how large the packages are. Standard library only.
"""

from __future__ import annotations

import json
import shutil
import tempfile
import urllib.parse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..capture.messages import Problem
from . import bare_environment, locks, pip_steps

RETRIES = ("--retries", "1")


@dataclass(frozen=True)
class InstallationPlan:
    """Package -> version, the hosts ("this disk" for files), and bytes to download and on disk."""

    packages: dict[str, str]
    hosts: tuple[str, ...]
    download: int
    disk: int

    @property
    def needed(self) -> int:
        """Free bytes needed: downloads and packages exist at the same time."""
        return self.download + self.disk


def plan_installation(
    requirements: Path,
    base: Path,
    compute: str,
    source: str,
    run: Callable[[list[str]], tuple[int, str]],
    say: Callable[[float, float, str], None] = lambda *_: None,
    wheels: Path | None = None,
) -> InstallationPlan:
    """Plan an installation from the Python `base`, for a device ("cpu", "cuda", "apple") and one of pip_steps.SOURCES.

    `run` runs a command and returns its exit code and last error. Raises Problem if there is no solver for this
    machine, or if the index cannot be reached or lacks a package.
    """
    lock = pip_steps.lock_of(base, requirements)
    wheels = Path(wheels) if source == "folder" else None
    with tempfile.TemporaryDirectory(prefix="wildcap_index_", ignore_cleanup_errors=True) as folder:
        say(0, 3, "preparing to ask the package index")
        python = bare_environment.make(Path(folder) / "environment", base, requirements, run, wheels)
        pip = [python, *pip_steps.INSTALL, *RETRIES]
        say(1, 3, "preparing to ask the package index")
        if wheels is None:
            # a pip that reads metadata without downloading packages; an old one works, slowly
            run([*pip, "--quiet", *pip_steps.PINNED, "--require-hashes", "-r", requirements / "locks" / "pip.txt"])
        packages, report = {}, Path(folder) / "report.json"

        def ask(words: tuple[str, ...]) -> tuple[int, str]:
            code, error = run([*pip, "--dry-run", "--quiet", "--ignore-installed", "--report", report, *words])
            for entry in json.loads(report.read_text(encoding="utf-8"))["install"] if not code else ():
                about = entry["metadata"]
                packages[locks.normal(about["name"])] = about["version"], entry["download_info"]["url"]
            return code, error

        todo = pip_steps.plan_steps(requirements, lock, compute, source, Path(folder), wheels)
        code, error = pip_steps.carry_out(
            todo, ask, lambda done: say(2 + done / len(todo), 3, "asking the package index")
        )
        if code:
            raise Problem(
                f"The package index did not answer as expected ({pip_steps.shorten(error)}).",
                "Check the network connection, and try again.",
            )
    known_sizes = locks.known_sizes(requirements, lock.name)
    sizes = [known_sizes[f"{name}=={version}"] for name, (version, _) in packages.items()]
    hosts = sorted({urllib.parse.urlsplit(url).hostname or "this disk" for _, url in packages.values()})
    return InstallationPlan(
        {name: version for name, (version, _) in packages.items()},
        tuple(hosts),
        sum(size for size, _ in sizes),
        sum(disk for _, disk in sizes),
    )


def check_space(plan: InstallationPlan, folder: Path) -> int:
    """Return the free bytes on the disk of a folder, which need not exist. Raises Problem if the plan does not fit."""
    free = free_space(folder)
    if free < plan.needed:
        raise Problem(
            f"The disk that holds {folder} has {gigabytes(free)} free; {gigabytes(plan.needed)} are needed "
            "while the solver is installed.",
            "Free some space, or choose a solver folder on another disk.",
        )
    return free


def free_space(folder: Path) -> int:
    """Return the free bytes on the disk of a folder, which need not exist."""
    return shutil.disk_usage(next(path for path in (folder, *folder.absolute().parents) if path.is_dir())).free


def folder_size(folder: Path) -> int:
    """Return the bytes of all files in a folder, without following links."""
    return sum(path.lstat().st_size for path in Path(folder).rglob("*") if not path.is_dir())


def gigabytes(size: int) -> str:
    return f"{size / 1e9:.1f} GB" if size >= 1e8 else f"{size / 1e6:.0f} MB"
