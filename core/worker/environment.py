# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker's own Python environment: finding a Python to make it from, making, checking and removing it.

Ground floor: standard library only. Nothing is installed into Blender's Python. `Installation` is polled like a Worker.
"""

from __future__ import annotations

import json
import os
import queue
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

from ..capture import storage_problem
from ..messages import FINAL, Cancelled, Done, Failed, Message, Problem, Progress
from .background import Task

PYTHONS = ((3, 11), (3, 12))
"""Versions of Python for which every pinned requirement has a wheel."""
DISK_GB = 1.7
"""Size of the finished environment, measured on Linux with torch for the CPU; the CUDA build of torch, which is what PyPI has for Linux,
brings NVIDIA's libraries and takes several times as much."""
TORCH = "https://download.pytorch.org/whl/"
"""Where PyTorch keeps the builds that are not on PyPI, whose build for Linux brings CUDA and whose build for Windows is for the CPU."""
BUILDS = {("linux", "cpu"): "cpu", ("linux", "cuda"): "", ("win32", "cpu"): "", ("win32", "cuda"): "cu130", ("darwin", "cpu"): "", ("darwin", "apple"): ""}
"""Which of them a system and its choice need; '' for PyPI's. On a Mac there is one build, for both."""
COMPUTE_FILE = "wildcap_compute.txt"
"""Says in an environment for what it was made: another choice makes it anew."""
MODULES = {"opencv-contrib-python-headless": "cv2", "openimageio": "OpenImageIO", "scikit-image": "skimage"}
"""Modules of the packages that are called otherwise."""


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


def python_of(folder: Path) -> Path:
    """Where an environment's Python is."""
    return Path(folder) / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def required(requirements: Path) -> dict[str, str]:
    """Package -> pinned version, of worker.txt and nets.txt in the folder `requirements`."""
    lines = [line.partition("#")[0].strip() for name in ("worker.txt", "nets.txt") for line in (requirements / name).read_text(encoding="utf-8").splitlines()]
    return dict(line.split("==") for line in lines if line)


def verify(python: Path, requirements: Path, importing: bool = False) -> list[str]:
    """What keeps `python` from running the worker, one sentence each; [] when nothing does.

    With `importing` every module is imported as well (some ten seconds), which finds broken installations.
    """
    return judge(survey(python, requirements, importing), requirements)


def survey(python: Path, requirements: Path, importing: bool = False) -> dict:
    """What a Python has: {"python": [major, minor], "versions": {package: version or None}, "opencv": [packages], "errors": {module: text},
    "device": "cpu", "cuda" or "mps"}. Raises Problem when it cannot be run."""
    # mediapipe is never imported: its network files are read, nothing else.
    modules = [MODULES.get(name, name) for name in required(requirements) if name != "mediapipe"] if importing else []
    printed = answer(python, _SURVEY % {"names": list(required(requirements)), "modules": modules}, 300)
    try:
        return json.loads(printed.splitlines()[-1])
    except (ValueError, IndexError):
        raise Problem(f"{python} is not a working Python.", "Choose another Python, or install the solver again.") from None


def judge(found: dict, requirements: Path) -> list[str]:
    """What is wrong with a survey's findings, one sentence each."""
    problems = []
    if tuple(found["python"]) not in PYTHONS:
        problems.append(f"It is Python {found['python'][0]}.{found['python'][1]}; " + " or ".join(f"{a}.{b}" for a, b in PYTHONS) + " is needed.")
    for name, version in required(requirements).items():
        has = found["versions"][name]
        if has is None:
            problems.append(f"{name} {version} is missing.")
        elif has.partition("+")[0] != version:
            problems.append(f"{name} is {has}, not {version}.")
    if len(found["opencv"]) > 1:
        problems.append(f"More than one OpenCV is installed ({', '.join(found['opencv'])}); remove all but opencv-contrib-python-headless.")
    return problems + [f"{module} does not load: {text}." for module, text in found["errors"].items()]


def remove(folder: Path) -> None:
    """Deletes an environment. Raises Problem for a folder that is none, or that cannot be deleted."""
    folder = Path(folder)
    check_removable(folder)
    if not folder.exists():
        return
    try:
        shutil.rmtree(folder)
    except OSError as error:
        raise storage_problem(error, folder) from error


def compute_of(choice: str) -> str:
    """What 'auto' means on this machine: 'apple' on a Mac, 'cuda' with NVIDIA's driver, else 'cpu'. Raises Problem for what cannot be here."""
    system = "linux" if sys.platform.startswith("linux") else sys.platform
    if choice == "auto":
        choice = "apple" if system == "darwin" else "cuda" if shutil.which("nvidia-smi") else "cpu"
    if (system, choice) not in BUILDS:
        raise Problem(f"There is no solver for {choice} on this system.", "Choose Automatic.")
    return choice


def pip_steps(requirements: Path, compute: str) -> list[list[str]]:
    """The arguments of each `pip install` in turn. `compute`: 'cpu', 'cuda' or 'apple'."""
    build = BUILDS["linux" if sys.platform.startswith("linux") else sys.platform, compute]
    version = required(requirements).get("torch")
    # A page of links for this one package, so that no other one can come from there.
    torch = [f"torch=={version}+{build}", "--find-links", f"{TORCH}{build}/torch/"] if build and version else []
    return [["-r", str(requirements / "worker.txt"), *torch], ["--no-deps", "-r", str(requirements / "nets.txt")]]


def check_removable(folder: Path) -> None:
    """Raises Problem for a folder that is no environment."""
    if Path(folder).exists() and not (Path(folder) / "pyvenv.cfg").is_file():
        raise Problem(f"{folder} is not a Python environment, so it is not deleted.", "Choose the folder that the solver was installed to.")


def removal(folder: Path) -> Task:
    """`remove` in the background: an environment has tens of thousands of files."""
    def work(task: Task) -> None:
        task.say(0, 1, "deleting the solver")
        remove(folder)

    return Task("environment", work)


class Installation:
    """Makes an environment in the background; `poll` it like a Worker. A second one in the same folder continues a broken one."""

    def __init__(self, folder: Path, requirements: Path, log: Path, base: Path | None = None, compute: str = "auto"):
        """`folder` is new, empty, or one that an earlier installation began; `base` is the Python to make it from (None: found);
        `compute` is 'auto', 'cpu', 'cuda' or 'apple'."""
        self.folder = Path(folder)
        self.requirements = Path(requirements)
        self.log = Path(log)
        self.compute = compute
        self._base = base
        self._messages: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._process: subprocess.Popen | None = None
        self._cancelled = threading.Event()
        self.running = False

    def start(self) -> None:
        """Raises Problem when the folder is somebody else's."""
        self.compute = compute_of(self.compute)
        if self.folder.is_dir() and any(self.folder.iterdir()) and not (self.folder / "pyvenv.cfg").is_file():
            raise Problem(f"{self.folder} holds other files.", "Choose an empty folder.")
        self.running = True
        threading.Thread(target=self._work, name="wildcap-installation", daemon=True).start()

    def poll(self) -> list[Message]:
        """The messages since the last call: Progress in packages (stage 'environment'), and Done, Cancelled or Failed as the last."""
        found = []
        while self.running and not self._messages.empty():
            found.append(self._messages.get())
            self.running = not isinstance(found[-1], FINAL)
        return found

    def cancel(self) -> None:
        """Stops at once; what was downloaded stays in pip's cache and the next installation continues."""
        self._cancelled.set()
        if self._process is not None and self._process.poll() is None:
            self._process.kill()

    def _work(self) -> None:
        started = time.monotonic()
        try:
            self.log.parent.mkdir(parents=True, exist_ok=True)
            with open(self.log, "w", encoding="utf-8") as log:
                final = self._install(log)
        except Problem as problem:
            final = Failed("environment", problem.problem, problem.remedy)
        except OSError as error:
            problem = storage_problem(error, self.folder)
            final = Failed("environment", problem.problem, problem.remedy)
        self._messages.put(final or Done(round(time.monotonic() - started, 1)))

    def _install(self, log) -> Message | None:
        python, mark = python_of(self.folder), self.folder / COMPUTE_FILE
        pip = [python, "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--progress-bar", "off"]
        steps = [[*pip, *words] for words in pip_steps(self.requirements, self.compute)]
        other = mark.is_file() and mark.read_text(encoding="utf-8") != self.compute
        if other or answer(python, "import pip; print('pip')") != "pip":  # not begun, or broken on the way
            steps.insert(0, [self._base or base_python(), "-m", "venv", "--clear", self.folder])
        self._seen = 0
        for i, step in enumerate(steps):
            if i == len(steps) - 2:
                mark.write_text(self.compute, encoding="utf-8")
            code, last_error = self._run([str(word) for word in step], log)
            if self._cancelled.is_set():
                return Cancelled("environment")
            if code != 0:
                return self._failure(last_error)
        self._messages.put(Progress("environment", 99, 100, "trying every package"))
        problems = verify(python, self.requirements, importing=True)
        return Failed("environment", problems[0], f"Install again; the log is {self.log}.") if problems else None

    def _run(self, command: list[str], log) -> tuple[int, str]:
        """Runs one command into the log, package by package into messages; its exit code and its last line of error."""
        environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
        flags = {"creationflags": subprocess.CREATE_NO_WINDOW} if os.name == "nt" else {}
        self._process = subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                         encoding="utf-8", errors="replace", **flags)
        if self._cancelled.is_set():
            self._process.kill()
        last_error = ""
        expected = 3 * len(required(self.requirements))  # each brings about two more
        with self._process.stdout as lines:
            for line in lines:
                log.write(line)
                last_error = line.strip() if "error" in line.lower() else last_error
                if line.startswith(("Collecting", "  Downloading", "Installing collected")):
                    self._seen += line.startswith("Collecting")
                    self._messages.put(Progress("environment", min(self._seen, expected), expected, line.strip().split(" (from")[0][:80]))
        return self._process.wait(), last_error

    def _failure(self, last_error: str) -> Failed:
        text = last_error.lower()
        if "no space left" in text or "disk" in text:
            return Failed("environment", f"The disk that holds {self.folder} is full.", "Free some space, or choose another folder, and install again.")
        if any(words in text for words in ("no matching distribution", "connection", "timed out", "resolve", "retries")):
            return Failed("environment", "A package could not be downloaded.",
                          f"Check the network connection and install again; it continues. The log is {self.log}.")
        said = last_error.removeprefix("ERROR: ").rstrip(".") or "no message"
        return Failed("environment", f"The installation stopped ({said}).", f"Install again; the log is {self.log}.")


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
torch = sys.modules.get("torch")
device = "cpu" if torch is None else "cuda" if torch.cuda.is_available() else "mps" if torch.backends.mps.is_available() else "cpu"
opencv = sorted({d.name for d in metadata.distributions() if d.name and d.name.lower().startswith("opencv")})
versions = {name: version(name) for name in %(names)s}
print(json.dumps({"python": sys.version_info[:2], "versions": versions, "opencv": opencv, "errors": errors, "device": device}))
"""


def answer(python: str | Path, code: str, timeout_s: float = 20) -> str:
    """What `python` prints for `code`; '' when it cannot be run."""
    flags = {"creationflags": subprocess.CREATE_NO_WINDOW} if os.name == "nt" else {}
    try:
        result = subprocess.run([str(python), "-E", "-s", "-c", code], capture_output=True, text=True, timeout=timeout_s, stdin=subprocess.DEVNULL, **flags)
        return result.stdout.strip()
    except (OSError, subprocess.TimeoutExpired):
        return ""
