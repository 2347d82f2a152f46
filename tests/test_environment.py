# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker's environment: made from nothing, continued after a failure, checked and removed; without the network."""

import os
import sys
import time
import zipfile
from pathlib import Path

import pytest

from core.messages import Cancelled, Done, Failed, Problem, Progress
from core.worker import environment
from core.worker.environment import Installation, find_python, judge, python_of, remove, required, survey, verify

REQUIREMENTS = Path(__file__).resolve().parent.parent / "requirements"


@pytest.fixture
def local(tmp_path, monkeypatch) -> Path:
    """A requirements folder whose two packages are wheels on this disk; pip may not look elsewhere."""
    wheels = tmp_path / "wheels"
    wheels.mkdir()
    for name in ("tinytorch", "tinynets"):
        with zipfile.ZipFile(wheels / f"{name}-1.0-py3-none-any.whl", "w") as wheel:
            info = f"{name}-1.0.dist-info"
            wheel.writestr(f"{name}.py", "")
            wheel.writestr(f"{info}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
            wheel.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
            wheel.writestr(f"{info}/RECORD", "")
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(wheels))
    folder = tmp_path / "requirements"
    folder.mkdir()
    (folder / "worker.txt").write_text("# what the worker needs\ntinytorch==1.0\n")
    (folder / "nets.txt").write_text("tinynets==1.0  # face nets\n")
    return folder


def follow(installation: Installation, timeout_s: float = 120) -> list:
    messages, deadline = [], time.monotonic() + timeout_s
    while installation.running:
        messages += installation.poll()
        assert time.monotonic() < deadline
        time.sleep(0.02)
    return messages


def test_an_installation_from_nothing_through_a_failure_to_removal(local, tmp_path):
    folder, log = tmp_path / "Umgebung é", tmp_path / "logs" / "install.log"
    (local / "worker.txt").write_text("tinytorch==2.0\n")
    installation = Installation(folder, local, log)
    installation.start()
    final = follow(installation)[-1]
    assert isinstance(final, Failed) and final.problem.startswith("A package could not be downloaded") and str(log) in final.remedy
    (local / "worker.txt").write_text("tinytorch==1.0\n")
    made = (folder / "pyvenv.cfg").stat().st_mtime_ns
    installation = Installation(folder, local, log)
    installation.start()
    messages = follow(installation)
    assert isinstance(messages[-1], Done) and any(isinstance(m, Progress) and "tinytorch" in m.text for m in messages)
    assert (folder / "pyvenv.cfg").stat().st_mtime_ns == made, "the second installation continues the first"
    assert verify(python_of(folder), local) == []
    (local / "nets.txt").write_text("tinynets==1.1\n")
    assert verify(python_of(folder), local) == ["tinynets is 1.0, not 1.1."]
    remove(folder)
    assert not folder.exists()
    remove(folder)


def test_a_cancelled_installation_says_so(local, tmp_path):
    installation = Installation(tmp_path / "env", local, tmp_path / "install.log")
    installation.start()
    installation.cancel()
    assert isinstance(follow(installation)[-1], Cancelled)


def test_other_peoples_folders_are_left_alone(local, tmp_path):
    mine = tmp_path / "photos"
    mine.mkdir()
    (mine / "a.jpg").write_bytes(b"1")
    with pytest.raises(Problem, match="other files"):
        Installation(mine, local, tmp_path / "log").start()
    with pytest.raises(Problem, match="not a Python environment"):
        remove(mine)
    assert (mine / "a.jpg").is_file()


def test_a_base_python_is_found_and_fits():
    found = find_python()
    if found is None:
        pytest.skip("no Python 3.11 or 3.12 with venv here")
    assert tuple(map(int, environment.answer(found, "import sys; print(*sys.version_info[:2])").split())) in environment.PYTHONS


def test_this_environment_is_judged_fit():
    found = survey(Path(sys.executable), REQUIREMENTS)
    assert set(found["versions"]) == set(required(REQUIREMENTS)) and found["device"] in ("cpu", "cuda", "mps")
    assert judge(found, REQUIREMENTS) == []


def test_what_is_wrong_is_said():
    good = {"python": [3, 11], "versions": {name: version + "+cpu" for name, version in required(REQUIREMENTS).items()},
            "opencv": ["opencv-contrib-python-headless"], "errors": {}, "device": "cpu"}
    assert judge(good, REQUIREMENTS) == []
    bad = {**good, "python": [3, 9], "versions": {**good["versions"], "torch": None, "av": "1.0"},
           "opencv": ["opencv-contrib-python-headless", "opencv-python"], "errors": {"torch": "OSError: cannot open libc10.so"}}
    problems = judge(bad, REQUIREMENTS)
    assert len(problems) == 5
    for words in ("3.9", "torch", "av is 1.0", "opencv-python", "libc10"):
        assert any(words in problem for problem in problems), words


@pytest.mark.parametrize("python", ["/no/such/python", os.devnull])
def test_what_is_no_python_is_told(python):
    with pytest.raises(Problem, match="not a working Python"):
        verify(Path(python), REQUIREMENTS)
