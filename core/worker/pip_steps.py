# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Arguments for pip to install the solver: which lock, which build of PyTorch, from where.

Every package is pinned, and where its hash is known, checked. Standard library only.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..capture.files import replacing
from ..capture.messages import Problem
from . import locks
from .environment import answer

TORCH = "https://download.pytorch.org/whl/"
"""Index of PyTorch's builds that are not on PyPI, which has CUDA for Linux and the CPU for Windows."""
BUILDS = {
    ("linux", "cpu"): "cpu",
    ("linux", "cuda"): "",
    ("win32", "cpu"): "",
    ("win32", "cuda"): "cu130",
    ("darwin", "cpu"): "",
    ("darwin", "apple"): "",
}
"""System and device -> build in that index, '' for PyPI's; on a Mac one build serves both."""
SOURCES = ("pytorch", "pip", "folder")
"""Where packages come from: PyTorch's builds from its own index, and the rest from the index that pip is configured for
(PyPI, a studio's mirror); everything from there; or everything from a folder of wheels."""
PINNED = ("--no-deps", "--only-binary", ":all:")
INSTALL = ("-I", "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--no-user")
"""Arguments of Python before those; --no-user, as `user = true` in a pip.conf would fail in an environment."""


def shorten(error: str) -> str:
    """Return pip's error for the middle of a sentence."""
    return error.removeprefix("ERROR: ").rstrip(".") or "no message"


def compute_of(choice: str) -> str:
    """Resolve "auto" to "apple" on a Mac, "cuda" with NVIDIA's driver, else "cpu". Raises Problem."""
    system = "linux" if sys.platform.startswith("linux") else sys.platform
    if choice == "auto":
        choice = "apple" if system == "darwin" else "cuda" if shutil.which("nvidia-smi") else "cpu"
    if (system, choice) not in BUILDS:
        raise Problem(f"There is no solver for {choice} on this system.", "Choose Automatic.")
    return choice


def lock_of(base: Path, requirements: Path) -> locks.Lock:
    """Return the lock for a Python on this machine. Raises Problem if there is none."""
    return locks.read(requirements, locks.lock_name(answer(base, locks.DESCRIBE)))


@dataclass(frozen=True)
class PipStep:
    """Arguments of one `pip install` or `pip download`, and of the runs that replace it if it fails."""

    words: tuple[str, ...]
    otherwise: tuple[tuple[str, ...], ...] = ()


def plan_steps(
    requirements: Path, lock: locks.Lock, compute: str, source: str, scratch: Path, wheels: Path | None = None
) -> list[PipStep]:
    """Return the steps that install a lock for a device, from one of SOURCES.

    `scratch` is a folder for files that pip reads, `wheels` the folder of the source "folder".
    """
    system = {"win_amd64": "win32", "macosx_arm64": "darwin"}.get(lock.platform, "linux")
    where = ("--no-index", "--find-links", str(wheels)) if source == "folder" else ()
    checked, whole = (*PINNED, "--require-hashes", *where), str(Path(requirements) / "locks" / f"{lock.name}.txt")
    build, own = BUILDS.get((system, compute), ""), locks.beside(requirements, lock.name, compute)
    cuda = locks.beside(requirements, lock.name, "cuda")
    # needed by the index's PyTorch for Linux
    libraries = ((*checked, "-r", str(cuda)),) if system == "linux" and cuda is not None else ()
    if own is None or not build:
        return [PipStep((*checked, "-r", whole)), *map(PipStep, libraries)]
    others = [line for name, line in lock.lines.items() if name != "torch"]
    rest = _write(Path(scratch) / "wildcap_packages.txt", others)
    torch = _write(Path(scratch) / "wildcap_torch.txt", [lock.lines["torch"]])
    hashes = ("--require-hashes",) if locks.read(requirements, f"{lock.name}-{compute}").verified else ()
    links = ("--find-links", f"{TORCH}{build}/torch/") if source == "pytorch" else where
    # another index than PyTorch's may lack its build
    instead = () if source == "pytorch" else ((*checked, "-r", torch), *libraries)
    return [PipStep((*checked, "-r", rest)), PipStep((*PINNED, *hashes, *links, "-r", str(own)), instead)]


def carry_out(
    todo: list[PipStep],
    run: Callable[[tuple[str, ...]], tuple[int, str]],
    say: Callable[[int], None] = lambda done: None,
) -> tuple[int, str]:
    """Run steps until one fails; return the last exit code and error. `say` takes the number of finished steps."""
    code, error = 0, ""
    for done, step in enumerate(todo):
        say(done)
        code, error = run(step.words)
        for words in step.otherwise if code else ():
            code, error = run(words)
            if code:
                break
        if code:
            break
    return code, error


def _write(path: Path, lines: list[str]) -> str:
    with replacing(path) as temporary:
        temporary.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return str(path)
