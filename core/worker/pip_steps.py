# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What pip is told to bring the solver to a machine: which lock, which build of PyTorch, from where.

Standard library only. Every package is pinned; where its hash is known, no other file is taken for it.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from ..capture.files import replacing
from ..capture.messages import Problem
from . import locks
from .environment import answer

TORCH = "https://download.pytorch.org/whl/"
"""Where PyTorch keeps the builds that are not on PyPI, whose build for Linux brings CUDA and whose build for Windows is
for the CPU."""
BUILDS = {
    ("linux", "cpu"): "cpu",
    ("linux", "cuda"): "",
    ("win32", "cpu"): "",
    ("win32", "cuda"): "cu130",
    ("darwin", "cpu"): "",
    ("darwin", "apple"): "",
}
"""Which of them a system and its choice need; '' for PyPI's. On a Mac there is one build, for both."""
SOURCES = ("pytorch", "pip", "folder")
"""Where packages come from: PyTorch from its own index for the builds above and the others from where this machine's
pip is set up to look; or all from there (pip.conf, PIP_INDEX_URL and their like: a studio's mirror), which then also
decides what the build computes on; or all from a folder of wheels."""
PINNED = ("--no-deps", "--only-binary", ":all:")
INSTALL = ("-I", "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--no-user")
"""What a Python is told before that: `user = true` in somebody's pip.conf is not for this environment, where pip would
refuse it."""


def compute_of(choice: str) -> str:
    """What 'auto' means on this machine: 'apple' on a Mac, 'cuda' with NVIDIA's driver, else 'cpu'. Raises Problem for
    what cannot be here."""
    system = "linux" if sys.platform.startswith("linux") else sys.platform
    if choice == "auto":
        choice = "apple" if system == "darwin" else "cuda" if shutil.which("nvidia-smi") else "cpu"
    if (system, choice) not in BUILDS:
        raise Problem(f"There is no solver for {choice} on this system.", "Choose Automatic.")
    return choice


def lock_of(base: Path, requirements: Path) -> locks.Lock:
    """The lock for a Python on this machine. Raises Problem where there is none."""
    return locks.read(requirements, locks.lock_name(answer(base, locks.DESCRIBE)))


@dataclass(frozen=True)
class PipStep:
    """The arguments of one `pip install` or `pip download`, and those of the ones to run in its place where pip cannot
    carry it out."""

    words: tuple[str, ...]
    otherwise: tuple[tuple[str, ...], ...] = ()


def plan_steps(
    requirements: Path, lock: locks.Lock, compute: str, source: str, scratch: Path, wheels: Path | None = None
) -> list[PipStep]:
    """What pip is to do in turn.

    Parameters
    ----------
    requirements : the folder of requirements and locks
    lock : of the Python and the machine
    compute : 'cpu', 'cuda' or 'apple'
    source : one of SOURCES
    scratch : the folder for files that pip is to read
    wheels : the folder of 'folder'
    """
    system = {"win_amd64": "win32", "macosx_arm64": "darwin"}.get(lock.platform, "linux")
    where = ("--no-index", "--find-links", str(wheels)) if source == "folder" else ()
    checked, whole = (*PINNED, "--require-hashes", *where), str(Path(requirements) / "locks" / f"{lock.name}.txt")
    build, own = BUILDS.get((system, compute), ""), locks.beside(requirements, lock.name, compute)
    cuda = locks.beside(requirements, lock.name, "cuda")
    # the index's PyTorch for Linux needs them
    libraries = ((*checked, "-r", str(cuda)),) if system == "linux" and cuda is not None else ()
    if own is None or not build:
        return [PipStep((*checked, "-r", whole)), *map(PipStep, libraries)]
    rest = str(
        _write(Path(scratch) / "wildcap_packages.txt", (line for name, line in lock.lines.items() if name != "torch"))
    )
    torch = str(_write(Path(scratch) / "wildcap_torch.txt", [lock.lines["torch"]]))
    hashes = ("--require-hashes",) if locks.read(requirements, f"{lock.name}-{compute}").verified else ()
    links = ("--find-links", f"{TORCH}{build}/torch/") if source == "pytorch" else where
    # an index that is not PyTorch's may have its build or not
    instead = () if source == "pytorch" else ((*checked, "-r", torch), *libraries)
    return [PipStep((*checked, "-r", rest)), PipStep((*PINNED, *hashes, *links, "-r", str(own)), instead)]


def carry_out(
    todo: list[PipStep],
    run: Callable[[tuple[str, ...]], tuple[int, str]],
    say: Callable[[int], None] = lambda done: None,
) -> tuple[int, str]:
    """Runs steps in turn until one fails; the exit code and the last error of the last. `say` takes how many are
    done."""
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


def _write(path: Path, lines: Iterable[str]) -> Path:
    with replacing(path) as temporary:
        temporary.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return path
