# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The real worker over rooms of a few lines: how jobs end is tested in seconds, on every stage alike.

`build` copies the ground floor of core/ and puts a tiny room in each stage's place. Such a room digests its inputs into
its outputs, in steps, and misbehaves as CAPTURE/mood.json ({stage: mood}) tells it to; the file is no stage's input.
"""

import compileall
import json
import shutil
import sys
import time
from pathlib import Path
from py_compile import PycInvalidationMode

from core.capture import stages
from core.capture.capture import Capture
from core.capture.messages import Message
from core.worker.__main__ import NICE_VALUE
from core.worker.client import Worker
from core.worker.job import write_job

ROOT = Path(__file__).resolve().parent.parent
GROUND = ("__init__.py", "__main__.py", "batch", "capture", "settings", "worker")

ROOM = '''
import errno, hashlib, json, os, sys, time
from ...capture import stages
from ...capture.files import replacing, replacing_folder
from ...capture.messages import Problem

def run(capture, settings, report):
    stage = stages.by_name(__name__.rsplit(".", 1)[1])
    mood = json.loads((capture.root / "mood.json").read_text()).get(stage.name, "")
    digest = hashlib.sha256(stage.name.encode())
    for name in stage.reads:
        path = capture.root / name
        for file in sorted(path.iterdir()) if path.is_dir() else [path]:
            digest.update(file.read_bytes())
    for step in range(4):
        report.progress(step, 4, "working")
        time.sleep(0.005)
    if mood == "print":
        print("a library talks"); os.write(1, b"{raw bytes\\n"); sys.stdout.flush()
    if mood == "finding":
        raise Problem("The face is not there.", "Film it.")
    if mood == "bug":
        raise ZeroDivisionError("division by zero")
    if mood == "memory":
        raise MemoryError
    if mood == "full":
        raise OSError(errno.ENOSPC, "No space left on device", str(capture.root / "x.bin"))
    if mood == "module":
        import a_module_that_is_not_there
    if mood == "die":
        os._exit(9)
    if mood == "die once" and not (capture.root / "died.txt").exists():
        (capture.root / "died.txt").touch()
        os._exit(9)
    if mood == "nothing":
        return
    for name in stage.writes:
        path = capture.root / name
        if name.endswith("/"):
            with replacing_folder(path) as folder:
                (folder / "a.txt").write_text(digest.hexdigest())
                _dwell(mood, report)
        else:
            with replacing(path) as temporary:
                temporary.write_text(digest.hexdigest())
                _dwell(mood, report)
    report.figure("size_px", 64)

def _dwell(mood, report):
    """Half way through an output: for ever with reports, or for ever without."""
    while mood == "slow":
        report.progress(1, 2, "half written")
        time.sleep(0.02)
    while mood == "deaf":
        time.sleep(0.02)
'''

DEVICE = """
from types import SimpleNamespace
prove = lambda: SimpleNamespace(device="cpu", reason="There is no other.")
"""


def build(folder: Path) -> Path:
    """Makes the code tree under `folder` and returns it: the worker's root."""
    core = folder / "core"
    copy_ground(core)
    for stage in stages.STAGES:
        (core / "stages" / stage.name).mkdir(parents=True)
        (core / "stages" / stage.name / "__init__.py").write_text(ROOM, encoding="utf-8")
    shutil.copyfile(ROOT / "core" / "stages" / "__init__.py", core / "stages" / "__init__.py")
    shutil.copyfile(ROOT / "__main__.py", folder / "__main__.py")
    (core / "stages" / "solve" / "device.py").write_text(DEVICE, encoding="utf-8")
    compile_once(folder)
    return folder


def copy_ground(core: Path) -> None:
    """Makes the folder `core` with a copy of the ground floor, for a worker that runs from there."""
    core.mkdir(parents=True)
    for name in GROUND:
        path = ROOT / "core" / name
        if path.is_dir():
            shutil.copytree(path, core / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copyfile(path, core / name)


def compile_once(root: Path) -> None:
    """Leaves the byte code of a code tree beside it: no process that runs there writes any, and each of hundreds would
    compile all of it again. Told by what a file holds, for a test may change one within the second."""
    compileall.compile_dir(root, quiet=2, invalidation_mode=PycInvalidationMode.CHECKED_HASH)


def keep_pace(root: Path) -> None:
    """Has the workers of a code tree not step back for others, beside which they would get a thirtieth of a core while
    other tests run."""
    main = root / "core" / "worker" / "__main__.py"
    text = main.read_text(encoding="utf-8")
    assert f"NICE_VALUE = {NICE_VALUE}\n" in text
    main.write_text(text.replace(f"NICE_VALUE = {NICE_VALUE}\n", "NICE_VALUE = 0\n"), encoding="utf-8")


def start(root: Path, capture: Capture, mood: dict | None = None, **job) -> Worker:
    """Writes the job and starts the worker, with this Python."""
    capture.claim()
    (capture.root / "mood.json").write_text(json.dumps(mood or {}))
    worker = Worker(Path(sys.executable), root, write_job(capture, **job), capture.logs / "worker.log")
    worker.start()
    return worker


def follow(worker: Worker, until=lambda message: False, timeout_s: float = 30) -> list[Message]:
    """Polls to the end, or to the first message that `until` accepts."""
    messages, deadline = [], time.monotonic() + timeout_s
    while worker.running and time.monotonic() < deadline:
        for message in worker.poll():
            messages.append(message)
            if until(message):
                return messages
        time.sleep(0.01)
    assert not worker.running, f"the worker did not end within {timeout_s} s: {messages[-3:]}"
    return messages


def contents(capture: Capture) -> dict[str, str]:
    """Relative name -> text, of all that the stages wrote."""
    made = [capture.root / name for stage in stages.STAGES for name in stage.writes]
    files = [file for path in made for file in (sorted(path.iterdir()) if path.is_dir() else [path])]
    return {file.relative_to(capture.root).as_posix(): file.read_text() for file in files}
