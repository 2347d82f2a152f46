# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An environment examined and removed; one installation or removal at a time works in its folder."""

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

from core.capture import lease, processes
from core.capture.messages import Cancelled, CancelledError, Done
from core.worker import environment, installation, locks
from core.worker.environment import COMPUTE_FILE, judge, removal, remove, required, survey
from tests.fixtures.tiny_packages import follow, run

REQUIREMENTS = Path(__file__).resolve().parents[3] / "requirements"


def test_this_environment_is_judged_fit_and_a_base_python_is_found():
    found = survey(Path(sys.executable), REQUIREMENTS)
    assert set(found["versions"]) == set(required(REQUIREMENTS))
    assert found["device"] == "", "not tried without loading anything"
    assert judge(found, REQUIREMENTS) == []
    version = environment.answer(installation.find_python(), "import sys; print(*sys.version_info[:2])")
    assert tuple(map(int, version.split())) in locks.PYTHONS


def test_what_is_wrong_is_said():
    good = {
        "python": [3, 11],
        "versions": {name: version + "+cpu" for name, version in required(REQUIREMENTS).items()},
        "opencv": ["opencv-contrib-python-headless"],
        "errors": {},
        "device": "cpu",
    }
    assert judge(good, REQUIREMENTS) == []
    bad = {
        **good,
        "python": [3, 9],
        "versions": {**good["versions"], "torch": None, "av": "1.0"},
        "opencv": ["opencv-contrib-python-headless", "opencv-python"],
        "errors": {"torch": "OSError: cannot open libc10.so"},
    }
    problems = judge(bad, REQUIREMENTS)
    assert len(problems) == 5
    for words in ("3.9", "torch", "av is 1.0", "opencv-python", "libc10"):
        assert any(words in problem for problem in problems), words


@pytest.fixture
def folder(tmp_path) -> Path:
    """The folder of an environment without a file but the one that says that it is ours."""
    folder = tmp_path / "env"
    folder.mkdir()
    (folder / COMPUTE_FILE).write_text("")
    return folder


@pytest.mark.parametrize("at", range(4))
def test_a_removal_that_is_ended_at_any_file_can_be_asked_for_again(folder, tmp_path, at):
    elsewhere = tmp_path / "theirs"
    (folder / "lib" / "packages").mkdir(parents=True)
    elsewhere.mkdir()
    (elsewhere / "mine.txt").write_text("mine")
    for name in ("lib/packages/a.py", "pyvenv.cfg"):
        (folder / name).write_text("")
    (folder / "lib64").symlink_to(elsewhere, target_is_directory=True)
    left = iter(range(at))

    def check() -> None:
        if next(left, None) is None:
            raise CancelledError("environment")

    with pytest.raises(CancelledError):
        remove(folder, check)
    assert (folder / COMPUTE_FILE).is_file()
    assert isinstance(run(removal(folder))[-1], Done)
    assert not folder.exists() and (elsewhere / "mine.txt").is_file()


def test_one_at_a_time_works_on_a_folder_and_who_was_killed_holds_nothing(folder, tmp_path):
    """Another Blender at work in the folder, as its lock says; then it is killed."""
    other = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    holder = {"pid": other.pid, "began": processes._began(other.pid), "since": "noon", "token": "x"}
    lock = tmp_path / "env.wildcap-install.lock"
    lock.write_text(json.dumps({"host": processes.name_host(), **holder}))
    installing = installation.installation(
        folder, REQUIREMENTS, tmp_path / "log", Path(sys.executable), installation.PackageSource()
    )
    for task in (installing, removal(folder)):
        final = run(task)[-1]
        assert f"(process {other.pid} on" in final.problem and "on this installation" in final.problem
    assert lock.exists() and (folder / COMPUTE_FILE).is_file()
    other.kill()
    other.wait()
    assert isinstance(run(removal(folder))[-1], Done) and list(tmp_path.glob("env*")) == []


def test_what_was_cancelled_here_and_has_not_quite_ended_is_waited_for(folder, tmp_path):
    task, cancelled = removal(folder), removal(folder)
    with lease.hold_file(tmp_path / "env.wildcap-install.lock"):
        task.start()
        cancelled.start()
        time.sleep(0.5)
        assert "waiting" in task.poll()[-1].text
        cancelled.cancel()
        assert follow(cancelled, 2) == [Cancelled("environment")] and (folder / COMPUTE_FILE).is_file()
    assert isinstance(follow(task, 30)[-1], Done) and not folder.exists()
