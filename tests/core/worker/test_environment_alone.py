# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Two Blenders at one solver's folder, and what a cancel ends there; without the network."""

import json
import subprocess
import sys
import time
from pathlib import Path

from core.capture import lease, processes
from core.capture.messages import Cancelled, Done
from core.worker import installation
from core.worker.environment import COMPUTE_FILE, removal
from tests.core.worker.test_background import follow
from tests.core.worker.test_environment import bare, install, local, made_before, write_lock, write_wheel  # noqa: F401


def test_a_cancel_while_every_package_is_tried_ends_the_try_within_two_seconds(local, made_before, tmp_path):  # noqa: F811
    told = tmp_path / "told.txt"
    code = f"import os, time\nopen({str(told)!r}, 'w').write(str(os.getpid()))\ntime.sleep(120)\n"
    write_lock(local, write_wheel(tmp_path / "wheels", "tinytorch", code=code))
    task = installation.installation(
        tmp_path / "env", local, tmp_path / "install.log", None, installation.PackageSource()
    )
    task.start()
    deadline = time.monotonic() + 100
    while not (told.is_file() and told.read_text()):
        task.poll()
        assert time.monotonic() < deadline
        time.sleep(0.02)
    began = time.monotonic()
    task.cancel()
    assert isinstance(follow(task)[-1], Cancelled)
    tried = {"host": processes.name_host(), "pid": int(told.read_text())}
    while not processes.is_gone(tried) or _lock(tmp_path / "env").exists():
        assert time.monotonic() < began + 2
        time.sleep(0.02)


def test_one_at_a_time_works_on_a_folder_and_who_was_killed_holds_nothing(local, made_before, tmp_path):  # noqa: F811
    """Another Blender at work in the folder, as its lock says; then it is killed."""
    folder = tmp_path / "env"
    other = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    _lock(folder).write_text(
        json.dumps(
            {
                "host": processes.name_host(),
                "pid": other.pid,
                "since": "noon",
                "began": processes._began(other.pid),
                "token": "x",
            }
        )
    )
    final = install(folder, local)[-1]
    assert f"Another worker (process {other.pid} on" in final.problem and "on this installation" in final.problem
    assert not folder.exists() and _lock(folder).exists()
    folder.mkdir()
    (folder / COMPUTE_FILE).write_text("")
    task = removal(folder)
    task.start()
    assert "is working on this installation" in follow(task)[-1].problem and (folder / COMPUTE_FILE).is_file()
    other.kill()
    other.wait()
    assert isinstance(install(folder, local)[-1], Done) and not _lock(folder).exists()
    task = removal(folder)
    task.start()
    assert isinstance(follow(task)[-1], Done) and list(tmp_path.glob("env*")) == []


def test_what_was_cancelled_here_and_has_not_quite_ended_is_waited_for(tmp_path):
    folder = tmp_path / "env"
    folder.mkdir()
    (folder / COMPUTE_FILE).write_text("")
    task, cancelled = removal(folder), removal(folder)
    with lease.hold_file(_lock(folder)):
        task.start()
        cancelled.start()
        time.sleep(1)
        assert task.poll()[-1].text == "waiting for what was cancelled to end"
        cancelled.cancel()
        assert follow(cancelled, 2) == [Cancelled("environment")] and (folder / COMPUTE_FILE).is_file()
    assert isinstance(follow(task, 30)[-1], Done) and not folder.exists()


def _lock(folder: Path) -> Path:
    return folder.with_name(f"{folder.name}.wildcap-install.lock")
