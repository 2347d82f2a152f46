# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What an installation will download, from where, and how much disk it takes, before anything is installed.

Ground floor: standard library only. pip's dry run finds out whether the index has it all: it alone knows which index
this machine looks in, and which build of PyTorch a studio's has. How large the packages are, the locks say.
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
    """The packages by name and version, the hosts they come from ('this disk' for files), bytes to download and bytes
    once unpacked."""

    packages: dict[str, str]
    hosts: tuple[str, ...]
    download: int
    disk: int

    @property
    def needed(self) -> int:
        """Free bytes to have: while it installs, downloads and packages are both there."""
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
    """What an installation would bring (see installation.py).

    Parameters
    ----------
    requirements : the folder of requirements and locks
    base : the Python to make it from
    compute : 'cpu', 'cuda' or 'apple'
    source : one of pip_steps.SOURCES
    run : runs a command; its exit code and last error
    say : takes how far it is: done, of how much, doing what
    wheels : the folder of 'folder'

    Raises
    ------
    Problem
        When there is no solver for this machine, or the index cannot be reached or lacks a package.
    """
    lock = pip_steps.lock_of(base, requirements)
    wheels = Path(wheels) if source == "folder" else None
    with tempfile.TemporaryDirectory(prefix="wildcap_index_", ignore_cleanup_errors=True) as folder:
        say(0, 3, "preparing to ask the package index")
        python = bare_environment.make(Path(folder) / "environment", base, requirements, run, wheels)
        pip = [python, *pip_steps.INSTALL, *RETRIES]
        say(1, 3, "preparing to ask the package index")
        if wheels is None:
            # one that reads descriptions without downloading packages; an old one works, slowly
            run([*pip, "--quiet", *pip_steps.PINNED, "--require-hashes", "-r", requirements / "locks" / "pip.txt"])
        packages, report = {}, Path(folder) / "report.json"

        def ask(words: tuple[str, ...]) -> tuple[int, str]:
            code, error = run([*pip, "--dry-run", "--quiet", "--ignore-installed", "--report", report, *words])
            for entry in json.loads(report.read_text(encoding="utf-8"))["install"] if not code else ():
                packages[locks.normal(entry["metadata"]["name"])] = (
                    entry["metadata"]["version"],
                    entry["download_info"]["url"],
                )
            return code, error

        todo = pip_steps.plan_steps(requirements, lock, compute, source, Path(folder), wheels)
        code, error = pip_steps.carry_out(
            todo, ask, lambda done: say(2 + done / len(todo), 3, "asking the package index")
        )
        if code:
            raise Problem(
                f"The package index did not answer as expected "
                f"({error.removeprefix('ERROR: ').rstrip('.') or 'no message'}).",
                "Check the network connection, and try again.",
            )
    known = locks.known_sizes(requirements, lock.name)
    sizes = [known[f"{name}=={version}"] for name, (version, _) in packages.items()]
    hosts = sorted({urllib.parse.urlsplit(url).hostname or "this disk" for _, url in packages.values()})
    return InstallationPlan(
        {name: version for name, (version, _) in packages.items()},
        tuple(hosts),
        sum(size for size, _ in sizes),
        sum(disk for _, disk in sizes),
    )


def check_space(plan: InstallationPlan, folder: Path) -> int:
    """Bytes free on the disk of a folder that need not be there yet. Raises Problem when the plan does not fit."""
    free = free_space(folder)
    if free < plan.needed:
        raise Problem(
            f"The disk that holds {folder} has {gigabytes(free)} free; {gigabytes(plan.needed)} are needed "
            "while the solver is installed.",
            "Free some space, or choose a solver folder on another disk.",
        )
    return free


def free_space(folder: Path) -> int:
    """Bytes free on the disk of a folder that need not be there yet."""
    return shutil.disk_usage(next(path for path in (folder, *folder.absolute().parents) if path.is_dir())).free


def folder_size(folder: Path) -> int:
    """Bytes of all files in a folder; links are not followed."""
    return sum(path.lstat().st_size for path in Path(folder).rglob("*") if not path.is_dir())


def gigabytes(size: int) -> str:
    return f"{size / 1e9:.1f} GB" if size >= 1e8 else f"{size / 1e6:.0f} MB"
