# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Making the worker's own Python environment: from which Python, with which build of PyTorch, from where, and in the background.

Ground floor: standard library only. Nothing is installed into Blender's Python.
"""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

from ..contract.files import storage_problem
from ..contract.messages import Problem
from .background import Task
from .environment import PYTHONS, answer, python_of, required, verify

TORCH = "https://download.pytorch.org/whl/"
"""Where PyTorch keeps the builds that are not on PyPI, whose build for Linux brings CUDA and whose build for Windows is for the CPU."""
BUILDS = {("linux", "cpu"): "cpu", ("linux", "cuda"): "", ("win32", "cpu"): "", ("win32", "cuda"): "cu130", ("darwin", "cpu"): "", ("darwin", "apple"): ""}
"""Which of them a system and its choice need; '' for PyPI's. On a Mac there is one build, for both."""
SOURCES = ("pytorch", "pip")
"""Where PyTorch comes from: its own index for the builds above, or, as all other packages, from where this machine's pip is set up to look
(pip.conf, PIP_INDEX_URL and their like: a studio's mirror), which then also decides what the build computes on."""
COMPUTE_FILE = "wildcap_compute.txt"
"""Says in an environment for what, and from where, it was made: another choice makes it anew."""


def installation(folder: Path, requirements: Path, log: Path, base: Path | None = None, compute: str = "auto", source: str = "pytorch",
                 packages: int = 0) -> Task:
    """Makes an environment in the background. One in the same folder as a broken or cancelled one continues that.

    `folder` is new, empty, or one that an earlier installation began; `base` is the Python to make it from (None: found); `compute` is 'auto', 'cpu',
    'cuda' or 'apple'; `source` is one of SOURCES; `packages` is how many will come (0: guessed). The task's progress counts packages; what pip says goes
    to `log`. What a cancel leaves stays, and what was downloaded is in pip's cache. Raises Problem when the folder is somebody else's.
    """
    folder, compute = Path(folder), compute_of(compute)
    if folder.is_dir() and any(folder.iterdir()) and not (folder / "pyvenv.cfg").is_file():
        raise Problem(f"{folder} holds other files.", "Choose an empty folder.")
    expected = packages or 3 * len(required(requirements))  # each brings about two more

    def work(task: Task) -> None:
        try:
            log.parent.mkdir(parents=True, exist_ok=True)
            with open(log, "w", encoding="utf-8") as file:
                _install(task, folder, requirements, base, compute, source, _listener(task, file, expected), log)
        except OSError as error:
            raise storage_problem(error, folder) from error

    return Task("environment", work)


def find_python() -> Path | None:
    """A Python on this machine that the environment can be made from; None when there is none."""
    names = [f"python{major}.{minor}" for major, minor in PYTHONS] + ["python3", "python"]
    candidates = [sys.executable, *(shutil.which(name) for name in names)]
    candidates += [f"{folder}/{name}" for folder in ("/usr/bin", "/usr/local/bin", "/opt/homebrew/bin") for name in names]
    if os.name == "nt":
        base = Path(os.environ.get("LOCALAPPDATA", "")) / "Programs" / "Python"
        candidates += [base / f"Python{major}{minor}" / "python.exe" for major, minor in PYTHONS]
    for candidate in dict.fromkeys(filter(None, candidates)):
        if answer(candidate, f"import sys, venv, ensurepip; print(sys.version_info[:2] in {PYTHONS})") == "True":
            return Path(candidate)
    return None


def base_python() -> Path:
    """As `find_python`. Raises Problem when there is none."""
    found = find_python()
    if found is None:
        raise Problem("No Python 3.11 or 3.12 was found on this machine.", "Install one from python.org, then try again.")
    return found


def compute_of(choice: str) -> str:
    """What 'auto' means on this machine: 'apple' on a Mac, 'cuda' with NVIDIA's driver, else 'cpu'. Raises Problem for what cannot be here."""
    system = "linux" if sys.platform.startswith("linux") else sys.platform
    if choice == "auto":
        choice = "apple" if system == "darwin" else "cuda" if shutil.which("nvidia-smi") else "cpu"
    if (system, choice) not in BUILDS:
        raise Problem(f"There is no solver for {choice} on this system.", "Choose Automatic.")
    return choice


def pip_steps(requirements: Path, compute: str, source: str = "pytorch") -> list[list[str]]:
    """The arguments of each `pip install` in turn. `compute`: 'cpu', 'cuda' or 'apple'; `source`: one of SOURCES."""
    build = BUILDS["linux" if sys.platform.startswith("linux") else sys.platform, compute] if source == "pytorch" else ""
    version = required(requirements).get("torch")
    # A page of links for this one package, so that no other one can come from there.
    torch = [f"torch=={version}+{build}", "--find-links", f"{TORCH}{build}/torch/"] if build and version else []
    return [["-r", str(requirements / "worker.txt"), *torch], ["--no-deps", "-r", str(requirements / "nets.txt")]]


def _install(task: Task, folder: Path, requirements: Path, base: Path | None, compute: str, source: str, hear, log: Path) -> None:
    python, mark, made_for = python_of(folder), folder / COMPUTE_FILE, compute if source == "pytorch" else f"{compute} {source}"
    other = mark.is_file() and mark.read_text(encoding="utf-8") != made_for
    if other or answer(python, "import pip; print('pip')") != "pip":  # not begun, or broken on the way
        _step(task, [base or base_python(), "-m", "venv", "--clear", folder], hear, folder, log)
    mark.write_text(made_for, encoding="utf-8")
    pip = [python, "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--progress-bar", "off"]
    for words in pip_steps(requirements, compute, source):
        _step(task, [*pip, *words], hear, folder, log)
    task.say(99, 100, "trying every package")
    problems = verify(python, requirements, importing=True)
    if problems:
        raise Problem(problems[0], f"Install again; the log is {log}.")


def _step(task: Task, command: list, hear, folder: Path, log: Path) -> None:
    """Runs one command. Raises Problem where it fails."""
    code, error = task.run(command, hear)
    if code != 0:
        raise _failure(error, folder, log)


def _listener(task: Task, log, expected: int):
    """What hears pip's lines: into the log, and package by package into the task's progress."""
    seen = 0

    def hear(line: str) -> None:
        nonlocal seen
        log.write(line)
        log.flush()
        if line.startswith(("Collecting", "  Downloading", "Installing collected")):
            seen += line.startswith("Collecting")
            task.say(min(seen, expected), expected, line.strip().split(" (from")[0][:80])

    return hear


def _failure(last_error: str, folder: Path, log: Path) -> Problem:
    text = last_error.lower()
    if "no space left" in text or "disk" in text:
        return Problem(f"The disk that holds {folder} is full.", "Free some space, or choose another folder, and install again.")
    if any(words in text for words in ("no matching distribution", "connection", "timed out", "resolve", "retries")):
        return Problem("A package could not be downloaded.", f"Check the network connection and install again; it continues. The log is {log}.")
    said = last_error.removeprefix("ERROR: ").rstrip(".") or "no message"
    return Problem(f"The installation stopped ({said}).", f"Install again; the log is {log}.")
