# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The solver's environment: planned, made from nothing, continued, repaired, refused and cancelled; without a
network."""

import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from core.capture import processes
from core.capture.messages import Cancelled, Done, Failed, Progress
from core.worker import bare_environment, index, installation
from core.worker.background import BackgroundTask
from core.worker.environment import COMPUTE_FILE, empty, python_of, remove, verify
from core.worker.locks import Lock
from core.worker.pip_steps import PipStep
from tests.fixtures.refused import refuses
from tests.fixtures.tiny_packages import follow, run, write_lock, write_wheel

REQUIREMENTS = Path(__file__).resolve().parents[3] / "requirements"


@pytest.fixture
def wheels(tmp_path) -> Path:
    folder = tmp_path / "wheels"
    folder.mkdir()
    return folder


@pytest.fixture
def local(tmp_path, wheels, monkeypatch) -> Path:
    """A requirements folder whose two packages are wheels on this disk. pip may look nowhere else, and is set up to
    install anywhere but where it should."""
    (tmp_path / "pip.conf").write_text("[global]\nuser = true\n")
    for name, value in (
        ("NO_INDEX", "1"),
        ("FIND_LINKS", wheels),
        ("CONFIG_FILE", tmp_path / "pip.conf"),
        ("USER", "1"),
    ):
        monkeypatch.setenv(f"PIP_{name}", str(value))
    for name in ("TARGET", "PREFIX", "CONSTRAINT"):
        monkeypatch.setenv(f"PIP_{name}", str(tmp_path / "elsewhere"))
    folder = tmp_path / "requirements"
    write_lock(folder, write_wheel(wheels, "tinytorch"), write_wheel(wheels, "tinynets"))
    (folder / "worker.txt").write_text("# what the worker needs\ntinytorch==1.0\n")
    yield folder
    assert not (tmp_path / "elsewhere").exists()


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> Path:
    """An environment with nothing but pip in it."""
    folder = tmp_path_factory.mktemp("bare") / "env"
    bare_environment.make(folder, installation.base_python(), REQUIREMENTS, BackgroundTask("bare", print).run)
    return folder


@pytest.fixture
def copied(bare, monkeypatch) -> None:
    """An environment is not made, which takes seconds, but copied from one that was."""

    def make(folder: Path, base: Path, requirements: Path, run, wheels=None, wheel_only=False, keep="") -> Path:
        empty(folder, keep)
        shutil.copytree(bare, folder, symlinks=True, dirs_exist_ok=True)
        return python_of(folder)

    monkeypatch.setattr(bare_environment, "make", make)


def installing(folder: Path, requirements: Path, **options) -> BackgroundTask:
    source = installation.PackageSource(**options)
    return installation.installation(folder, requirements, folder.with_name("install.log"), None, source)


def install(folder: Path, requirements: Path, **options):
    return run(installing(folder, requirements, **options))[-1]


def test_the_life_of_an_environment(local, wheels, copied, tmp_path):
    folder = tmp_path / "Umgebung é"
    (folder / "lib" / "half").mkdir(parents=True)  # half made, as a machine that was switched off leaves it
    (folder / COMPUTE_FILE).write_text("")
    (wheels / "tinynets-1.0-py3-none-any.whl").rename(tmp_path / "away.whl")
    final = install(folder, local)
    assert isinstance(final, Failed) and "could not be downloaded" in final.problem and "install.log" in final.remedy
    assert not (folder / "lib" / "half").exists()

    (tmp_path / "away.whl").rename(wheels / "tinynets-1.0-py3-none-any.whl")
    (folder / "kept").touch()
    messages = run(installing(folder, local))
    assert isinstance(messages[-1], Done) and (folder / "kept").exists(), "the second installation continues the first"
    assert any(isinstance(m, Progress) and "tinynets" in m.text for m in messages)
    assert verify(python_of(folder), local) == []

    (local / "worker.txt").write_text("tinytorch==2.0\n")  # of a newer WildCap
    assert verify(python_of(folder), local) == ["tinytorch is 1.0, not 2.0."]
    write_lock(local, write_wheel(wheels, "tinytorch", "2.0"))
    assert isinstance(install(folder, local, compute="auto"), Done) and (folder / "kept").exists()
    assert verify(python_of(folder), local) == []

    (module,) = folder.rglob("tinytorch/__init__.py")
    shutil.rmtree(module.parent)
    told = verify(python_of(folder), local, importing=True)
    assert told == ["tinytorch does not load: ModuleNotFoundError: No module named 'tinytorch'."]
    assert isinstance(install(folder, local), Done) and not (folder / "kept").exists(), "repaired by being made anew"
    assert verify(python_of(folder), local, importing=True) == []

    (folder / "kept").touch()
    assert isinstance(install(folder, local, compute="cuda", source="pip"), Done)
    assert not (folder / "kept").exists(), "one for another device or from elsewhere is made anew"
    remove(folder)
    assert not folder.exists()
    remove(folder)


def test_a_cancel_ends_an_installation_within_two_seconds(local, wheels, copied, tmp_path):
    """At its beginning, and while every package is tried."""
    told = tmp_path / "told.txt"
    code = f"import os, time\nopen({str(told)!r}, 'w').write(str(os.getpid()))\ntime.sleep(120)\n"
    write_lock(local, write_wheel(wheels, "tinytorch", code=code))
    for late in (False, True):
        task = installing(tmp_path / "env", local)
        task.start()
        while late and not (told.is_file() and told.read_text()):
            assert task.poll() is not None and task.running
            time.sleep(0.02)
        began = time.monotonic()
        task.cancel()
        assert isinstance(follow(task)[-1], Cancelled)
    tried = {"host": processes.name_host(), "pid": int(told.read_text())}
    while not processes.is_gone(tried) or (tmp_path / "env.wildcap-install.lock").exists():
        assert time.monotonic() < began + 2
        time.sleep(0.02)


def test_what_an_installation_brings_is_known_before_it_begins(local, wheels, copied, tmp_path):
    commands: list[list[str]] = []

    def plan(task, answer=None):
        def run(command):
            commands.append(list(map(str, command)))
            return answer if answer and "--report" in command else task.run(command)

        return index.plan_installation(local, installation.base_python(), "cpu", "pytorch", run, task.say)

    task = BackgroundTask("index", plan)
    assert isinstance(run(task)[-1], Done)
    known = task.result
    assert known.packages == {"tinytorch": "1.0", "tinynets": "1.0"} and known.hosts == ("this disk",)
    assert known.download == sum(wheel.stat().st_size for wheel in wheels.iterdir())
    assert known.disk == 3 * known.download > 0
    assert len(commands) == 2 and all("--require-hashes" in command for command in commands), (
        "nothing that runs here comes unchecked, pip's own update neither"
    )
    assert str(local / "locks" / "pip.txt") in commands[0]
    assert index.check_space(known, tmp_path / "not" / "there") > known.needed == known.download + known.disk
    refuses("needed", index.check_space, replace(known, disk=1 << 60), tmp_path)
    task = BackgroundTask("index", lambda task: plan(task, (1, "ERROR: No matching distribution.")))
    assert "(No matching distribution)" in run(task)[-1].problem


def test_other_peoples_folders_are_left_alone(local, tmp_path):
    mine = tmp_path / "photos"
    mine.mkdir()
    for name in ("a.jpg", "pyvenv.cfg"):  # the second makes it an environment of somebody else's
        (mine / name).write_text("mine")
        refuses("other files", installing, mine, local)
    refuses("no environment that WildCap made", remove, mine)
    assert (mine / "a.jpg").is_file()


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ("ERROR: Could not install packages due to an OSError: [Errno 28] No space left on device", "disk"),
        ("ERROR: Connection reset by peer", "could not be downloaded"),
        ("ERROR: It is Tuesday.", "(It is Tuesday)"),
        ("ERROR: THESE PACKAGES DO NOT MATCH THE HASHES FROM THE REQUIREMENTS FILE.", "hash"),
        ("Killed", "(no message)"),
    ],
)
def test_an_installation_that_stops_says_why(tmp_path, monkeypatch, said, words):
    monkeypatch.setattr(installation, "lock_of", lambda *_: Lock("manylinux_x86_64-3.11", {}))
    monkeypatch.setattr(installation.bare_environment, "make", lambda *_, **__: None)
    monkeypatch.setattr(installation, "plan_steps", lambda *_: [PipStep((said,))])

    def refuse(task, command, hear):
        hear(said)
        return 1, said if "ERROR" in said else ""

    monkeypatch.setattr(BackgroundTask, "run", refuse)
    task = installation.installation(
        tmp_path / "env", REQUIREMENTS, tmp_path / "env.log", Path(sys.executable), installation.PackageSource()
    )
    assert words in run(task)[-1].problem and said in (tmp_path / "env.log").read_text()


def test_a_machine_without_a_python_to_begin_with(monkeypatch):
    monkeypatch.setattr(installation, "answer", lambda *_: "")
    refuses("does not answer", installation.base_python)
