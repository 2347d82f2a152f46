# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker's own Python environment: its requirements, its examination and removal; installation.py makes it.

Standard library only. Nothing is installed into Blender's Python.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from ..capture import lease, processes, switchlight_api
from ..capture.files import storage_problem
from ..capture.messages import Problem
from .background import BackgroundTask

PYTHONS = ((3, 11), (3, 12), (3, 13))
"""Versions of Python for which every direct requirement has a wheel; locks.py has those we make environments for."""
MODULES = {
    "opencv-contrib-python-headless": "cv2",
    "openimageio": "OpenImageIO",
    "scikit-image": "skimage",
    "pillow-heif": "pillow_heif",
}
"""Package -> its module, where the names differ."""
COMPUTE_FILE = "wildcap_compute.txt"
"""Marks a folder as our environment: the first file in it, empty until the environment is complete. It holds device,
source and lock; another choice makes the environment anew."""

SURVEY_S = 300
"""Longest time to import every package once: on a cold disk, behind a virus scanner."""


def python_of(folder: Path) -> Path:
    """Return the path of an environment's Python."""
    return Path(folder) / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def default_folder() -> Path:
    """Return the default place: a short path, outside of folders that a cloud or a roaming profile copies."""
    return Path.home() / ".wildcap" / "solver"


def required(requirements: Path) -> dict[str, str]:
    """Return package -> pinned version, of worker.txt in the folder `requirements`."""
    text = (requirements / "worker.txt").read_text(encoding="utf-8")
    lines = [line.partition("#")[0].strip() for line in text.splitlines()]
    return dict(line.split("==") for line in lines if line)


def verify(python: Path, requirements: Path, importing: bool = False, task: BackgroundTask | None = None) -> list[str]:
    """Return what keeps `python` from running the worker, one sentence each; see `survey`."""
    return judge(survey(python, requirements, importing, task), requirements)


def survey(python: Path, requirements: Path, importing: bool = False, task: BackgroundTask | None = None) -> dict:
    """Examine a Python.

    Returns {"python": [major, minor], "versions": {package: version or None}, "opencv": [packages], "errors": {module:
    text}, "device": "cpu", "cuda", "mps" or "", "reason"}. With `importing` (some ten seconds) every module is
    imported, and the device proven by a pass of the network. Raises Problem if the Python cannot be run, and
    CancelledError if `task` is cancelled.
    """
    modules = [MODULES.get(name, name) for name in required(requirements)] if importing else []
    root = str(Path(requirements).parent) if importing else ""
    code = _SURVEY % {"names": list(required(requirements)), "modules": modules, "root": root}
    task = task or BackgroundTask("survey", lambda task: None)
    lines: list[str] = []
    with contextlib.suppress(OSError):
        task.run([python, "-I", "-c", code], lines.append, SURVEY_S)
    try:
        return json.loads([line for line in lines if line.startswith("{")][-1])  # libraries may print, too
    except (ValueError, IndexError):
        raise Problem(
            f"{python} is not a working Python.", "Choose another Python, or install the solver again."
        ) from None


def judge(survey: dict, requirements: Path) -> list[str]:
    """Return the problems in a survey, one sentence each."""
    problems = []
    if tuple(survey["python"]) not in PYTHONS:
        has, *needed = ("{}.{}".format(*version) for version in (survey["python"], *PYTHONS))
        problems.append(f"It is Python {has}; {' or '.join(needed)} is needed.")
    for name, version in required(requirements).items():
        has = survey["versions"][name]
        if has is None:
            problems.append(f"{name} {version} is missing.")
        elif has.partition("+")[0] != version:
            problems.append(f"{name} is {has}, not {version}.")
    if len(survey["opencv"]) > 1:
        packages = ", ".join(survey["opencv"])
        problems.append(f"More than one OpenCV is installed ({packages}); keep only opencv-contrib-python-headless.")
    return problems + [f"{module} does not load: {text}." for module, text in survey["errors"].items()]


def remove(folder: Path, check: Callable[[], None] = lambda: None) -> None:
    """Delete an environment, its mark last: interrupted, it can be deleted again.

    `check` is called before each file and may raise. Raises Problem if it is not ours or cannot be deleted.
    """
    check_removable(folder)
    if not folder.exists():
        return
    try:
        empty(folder, COMPUTE_FILE, check)
        (folder / COMPUTE_FILE).unlink()
        folder.rmdir()
    except OSError as error:
        raise storage_problem(error, folder) from error


def empty(folder: Path, keep: str, check: Callable[[], None] = lambda: None) -> None:
    """Delete the contents of a folder except the file `keep`, without following links. Raises OSError."""
    for place, folders, files in os.walk(folder, topdown=False):
        for path in (Path(place, name) for name in (*files, *folders)):
            check()
            if path.is_dir() and not path.is_symlink():
                path.rmdir()
            elif path != folder / keep:
                path.unlink()


def check_removable(folder: Path) -> None:
    """Raise Problem for a folder that is not our environment."""
    if folder.exists() and not (folder / COMPUTE_FILE).is_file():
        raise Problem(
            f"{folder} is no environment that WildCap made, so it is not deleted.",
            "Choose the folder that the solver was installed to.",
        )


def removal(folder: Path) -> BackgroundTask:
    """Return a task that removes an environment, which has tens of thousands of files."""

    def work(task: BackgroundTask) -> None:
        task.say(0, 1, "deleting the solver")
        with alone_in(folder, task):
            remove(folder, task.check)

    return BackgroundTask("environment", work)


@contextlib.contextmanager
def alone_in(folder: Path, task: BackgroundTask) -> Iterator[None]:
    """Hold the lease of an environment's folder, a file beside it, against other installations and removals.

    A holder in this process was cancelled and is waited for. Raises Problem naming any other, and CancelledError.
    """
    path, here = folder.with_name(f"{folder.name}.wildcap-install.lock"), processes.identify_process().items()
    while here <= (lease.holder(path) or {}).items():
        task.say(0, 1, "waiting for what was cancelled to end")
        time.sleep(lease.LOOK_S)
    with lease.hold_file(path, lambda text: task.say(0, 1, text), "installation", lambda: task.cancelled):
        yield


_SURVEY = """
import importlib, json, sys
from importlib import metadata
def version(name):
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None
errors = {}
for module in %(modules)s:
    try:
        importlib.import_module(module)
    except Exception as error:
        errors[module] = f"{type(error).__name__}: {error}".splitlines()[0]
device, reason = "", ""
if %(root)r and "torch" in sys.modules and not errors:
    sys.path.insert(0, %(root)r)
    try:
        from core.stages.solve.device import prove
        device, reason = prove().device, prove().reason
    except Exception as error:
        device, reason = "cpu", f"The network does not run: {type(error).__name__}: {error}".splitlines()[0]
opencv = sorted({d.name for d in metadata.distributions() if d.name and d.name.lower().startswith("opencv")})
versions = {name: version(name) for name in %(names)s}
print(json.dumps({"python": sys.version_info[:2], "versions": versions, "opencv": opencv, "errors": errors,
                  "device": device, "reason": reason}))
"""


def answer(python: str | Path, code: str) -> str:
    """Return what `python` prints for `code`, '' if it cannot be run; isolated from the working directory."""
    flags = {"creationflags": subprocess.CREATE_NO_WINDOW} if os.name == "nt" else {}
    try:
        result = subprocess.run(
            [str(python), "-I", "-c", code],
            capture_output=True,
            text=True,
            timeout=20,
            stdin=subprocess.DEVNULL,
            env=switchlight_api.environment_without_key(),
            **flags,
        )
        return result.stdout.strip()
    except (OSError, subprocess.TimeoutExpired):
        return ""
