# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Installation of the worker's own Python environment in the background.

Standard library only. Nothing is installed into Blender's Python.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from ..capture.files import storage_problem
from ..capture.messages import Problem
from . import bare_environment, locks
from .background import BackgroundTask
from .environment import COMPUTE_FILE, alone_in, answer, python_of, required, verify
from .pip_steps import INSTALL, carry_out, compute_of, lock_of, plan_steps, shorten


@dataclass(frozen=True)
class PackageSource:
    """Build of PyTorch, and where packages come from."""

    compute: str = "auto"  # or "cpu", "cuda", "apple"
    source: str = "pytorch"  # one of pip_steps.SOURCES
    wheels: Path | None = None  # for the source "folder"


def installation(
    folder: Path, requirements: Path, log: Path, base: Path | None, chosen: PackageSource, packages: int = 0
) -> BackgroundTask:
    """Return a task that makes an environment from the Python `base`, or from one that it finds.

    It continues what an earlier installation left in the folder, and starts anew where that does not work. Its progress
    counts packages, of which `packages` will come (0: guessed). Raises Problem for a folder with other files.
    """
    folder, compute = Path(folder), compute_of(chosen.compute)
    if folder.is_dir() and any(folder.iterdir()) and not (folder / COMPUTE_FILE).is_file():
        raise Problem(f"{folder} holds other files.", "Choose an empty folder.")
    expected = packages or 3 * len(required(requirements))  # each brings about two more
    chosen = replace(chosen, compute=compute, wheels=Path(chosen.wheels) if chosen.source == "folder" else None)

    def work(task: BackgroundTask) -> None:
        try:
            for place in (log.parent, folder.parent):
                place.mkdir(parents=True, exist_ok=True)
            with alone_in(folder, task), open(log, "w", encoding="utf-8") as file:
                hear = _listener(task, file, expected)
                _install(task, hear, folder, requirements, base or base_python(), chosen, log)
        except OSError as error:
            raise storage_problem(error, folder) from error

    return BackgroundTask("environment", work)


def find_python() -> Path | None:
    """Return a Python that an environment can be made from, preferably Blender's own, or None."""
    own = "{}.{}".format(*sys.version_info)
    names = [f"python{major}.{minor}" for major, minor in locks.PYTHONS] + ["python3", "python"]
    candidates = [
        sys.executable,
        f"{sys.base_prefix}/bin/python{own}",
        f"{sys.base_prefix}/bin/python.exe",
        *(shutil.which(name) for name in names),
    ]
    candidates += [
        f"{folder}/{name}" for folder in ("/usr/bin", "/usr/local/bin", "/opt/homebrew/bin") for name in names
    ]
    if os.name == "nt":
        programs = Path(os.environ.get("LOCALAPPDATA", "")) / "Programs" / "Python"
        candidates += [programs / f"Python{major}{minor}" / "python.exe" for major, minor in locks.PYTHONS]
    for candidate in dict.fromkeys(filter(None, candidates)):
        with contextlib.suppress(Problem):
            locks.lock_name(answer(candidate, locks.DESCRIBE))
            return Path(candidate)
    return None


def base_python() -> Path:
    """Return a Python as `find_python` does. Raises Problem with what is wrong with Blender's own if there is none."""
    python = find_python()
    if python is None:
        locks.lock_name(answer(sys.executable, locks.DESCRIBE))
    return python


def _install(
    task: BackgroundTask,
    hear: Callable[[str], None],
    folder: Path,
    requirements: Path,
    base: Path,
    chosen: PackageSource,
    log: Path,
) -> None:
    """Make or continue an environment; `hear` takes each line of pip's output. Raises Problem."""
    lock = lock_of(base, requirements)
    locks.check_path(lock, folder, limited=os.name == "nt")
    made_for = " ".join((chosen.compute, chosen.source, lock.name))

    def run(command) -> tuple[int, str]:
        return task.run(command, hear)

    def bring(anew: bool) -> list[str]:
        """Run all steps once, and return what is wrong afterwards."""
        if anew:
            task.say(0, 100, "making the solver's folder")
            folder.mkdir(parents=True, exist_ok=True)
            (folder / COMPUTE_FILE).write_text("", encoding="utf-8")
            bare_environment.make(folder, base, requirements, run, chosen.wheels, keep=COMPUTE_FILE)
            (folder / COMPUTE_FILE).write_text(made_for, encoding="utf-8")
        pip = [python_of(folder), *INSTALL, "--progress-bar", "off"]
        steps = plan_steps(requirements, lock, chosen.compute, chosen.source, folder, chosen.wheels)
        code, error = carry_out(steps, lambda words: run([*pip, *words]))
        if code:
            raise _failure(error, folder, log)
        task.say(99, 100, "trying every package")
        return verify(python_of(folder), requirements, importing=True, task=task)

    continued = _begun(folder, made_for)
    problems = bring(anew=not continued)
    if problems and continued:  # pip trusts an environment's metadata although files may be missing or damaged
        problems = bring(anew=True)
    if problems:
        raise Problem(problems[0], f"Install again; the log is {log}.")


def _begun(folder: Path, made_for: str) -> bool:
    """Return whether an earlier installation of the same kind left an environment with a working pip."""
    mark = folder / COMPUTE_FILE
    return (
        mark.is_file()
        and mark.read_text(encoding="utf-8") == made_for
        and answer(python_of(folder), "import pip; print('pip')") == "pip"
    )


def _listener(task: BackgroundTask, log, expected: int):
    """Return a function that writes pip's lines to the log, and counts packages in the task's progress."""
    count = 0

    def hear(line: str) -> None:
        nonlocal count
        log.write(line)
        log.flush()
        if line.startswith(("Collecting", "  Downloading", "Installing collected")):
            count += line.startswith("Collecting")
            task.say(min(count, expected), expected, line.strip().split(" (from")[0][:80])

    return hear


def _failure(last_error: str, folder: Path, log: Path) -> Problem:
    text = last_error.lower()
    if "do not match the hashes" in text:
        return Problem(
            "A package is not the file that WildCap was made with: its hash differs.",
            f"Install again, or ask who runs your package index; the log is {log}.",
        )
    if "no space left" in text or "disk" in text:
        return Problem(
            f"The disk that holds {folder} is full.", "Free some space, or choose another folder, and install again."
        )
    if any(words in text for words in ("no matching distribution", "connection", "timed out", "resolve", "retries")):
        return Problem(
            "A package could not be downloaded.",
            f"Check the network connection and install again; it continues. The log is {log}.",
        )
    return Problem(f"The installation stopped ({shorten(last_error)}).", f"Install again; the log is {log}.")
