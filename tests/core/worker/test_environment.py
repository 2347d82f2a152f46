# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker's environment: made from nothing, continued after a failure, checked and removed; without the network."""

import hashlib
import shutil
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from core.capture.messages import Cancelled, CancelledError, Done, Failed, Problem, Progress
from core.worker import bare_environment, index, installation, locks
from core.worker.background import BackgroundTask
from core.worker.environment import COMPUTE_FILE, answer, empty, python_of, removal, remove, verify
from tests.core.worker.test_background import follow

REQUIREMENTS = Path(__file__).resolve().parents[3] / "requirements"


HERE = locks.lock_name(answer(sys.executable, locks.DESCRIBE))


def write_wheel(folder: Path, name: str, version: str = "1.0", code: str = "") -> Path:
    path = folder / f"{name}-{version}-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as wheel:
        info = f"{name}-{version}.dist-info"
        wheel.writestr(f"{name}.py", code)
        wheel.writestr(f"{info}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
        wheel.writestr(
            f"{info}/WHEEL", "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        )
        wheel.writestr(f"{info}/RECORD", f"{name}.py,,\n{info}/METADATA,,\n{info}/WHEEL,,\n{info}/RECORD,,\n")
    return path


def write_lock(requirements: Path, *wheels: Path) -> None:
    """The lock for this machine and Python, of these wheels alone."""
    (requirements / "locks").mkdir(exist_ok=True)
    lines = []
    for wheel in wheels:
        pinned, size = "{}=={}".format(*wheel.name.split("-")[:2]), wheel.stat().st_size
        lines += [
            f"{pinned} --hash=sha256:{hashlib.sha256(wheel.read_bytes()).hexdigest()}\n",
            f"# {pinned}: {size} bytes, {3 * size} on disk\n",
        ]
    (requirements / "locks" / f"{HERE}.txt").write_text("".join(lines))


@pytest.fixture
def local(tmp_path, monkeypatch) -> Path:
    """A requirements folder whose two packages are wheels on this disk; pip may not look elsewhere."""
    wheels = tmp_path / "wheels"
    wheels.mkdir()
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(wheels))
    folder = tmp_path / "requirements"
    folder.mkdir()
    (folder / "worker.txt").write_text("# what the worker needs\ntinytorch==1.0\n")
    write_lock(folder, write_wheel(wheels, "tinytorch"), write_wheel(wheels, "tinynets"))
    return folder


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> Path:
    """An environment with nothing but pip in it."""
    folder = tmp_path_factory.mktemp("bare") / "env"
    bare_environment.make(folder, installation.base_python(), REQUIREMENTS, BackgroundTask("bare", print).run)
    return folder


@pytest.fixture
def made_before(bare, monkeypatch) -> None:
    """An environment is not made, which takes seconds, but copied from one that was: for what comes after that. How
    one is made from nothing, and made anew, is asked for by the tests without this, and by test_bare_environment.py."""

    def make(folder: Path, base: Path, requirements: Path, run, wheels=None, wheel_only=False, keep="") -> Path:
        empty(folder, keep)
        shutil.copytree(bare, folder, symlinks=True, dirs_exist_ok=True)
        return python_of(folder)

    monkeypatch.setattr(bare_environment, "make", make)


def install(folder: Path, local: Path, **options) -> list:
    task = installation.installation(
        folder, local, folder.with_name("install.log"), None, installation.PackageSource(**options)
    )
    task.start()
    return follow(task)


def test_an_installation_from_nothing_through_a_failure_and_another_device_to_removal(local, tmp_path):
    folder, wheels = tmp_path / "Umgebung é", tmp_path / "wheels"
    (wheels / "tinynets-1.0-py3-none-any.whl").rename(tmp_path / "away.whl")
    final = install(folder, local)[-1]
    assert (
        isinstance(final, Failed)
        and final.problem.startswith("A package could not be downloaded")
        and "install.log" in final.remedy
    )
    (tmp_path / "away.whl").rename(wheels / "tinynets-1.0-py3-none-any.whl")
    made = (folder / "pyvenv.cfg").stat().st_mtime_ns
    messages = install(folder, local)
    assert isinstance(messages[-1], Done), messages[-1]
    assert any(isinstance(m, Progress) and "tinynets" in m.text for m in messages)
    assert (folder / "pyvenv.cfg").stat().st_mtime_ns == made, "the second installation continues the first"
    assert verify(python_of(folder), local) == []
    for options, fresh in (({"compute": "auto"}, False), ({"compute": "cuda", "source": "pip"}, True)):
        (folder / "kept").write_text("of this environment")
        assert isinstance(install(folder, local, **options)[-1], Done)
        assert (folder / "kept").exists() != fresh, "one for another device or from elsewhere is made anew"
    remove(folder)
    assert not folder.exists()
    remove(folder)


def test_wherever_pip_is_set_up_to_put_packages_this_environment_gets_them(local, made_before, tmp_path, monkeypatch):
    (tmp_path / "pip.conf").write_text("[global]\nuser = true\n")
    monkeypatch.setenv("PIP_CONFIG_FILE", str(tmp_path / "pip.conf"))
    monkeypatch.setenv("PIP_USER", "1")
    for name in ("PIP_TARGET", "PIP_PREFIX", "PIP_CONSTRAINT"):
        monkeypatch.setenv(name, str(tmp_path / "elsewhere"))
    task = BackgroundTask(
        "index", lambda task: index.plan_installation(local, installation.base_python(), "cpu", "pytorch", task.run)
    )
    task.start()
    assert isinstance(follow(task)[-1], Done) and task.result.packages.keys() == {"tinytorch", "tinynets"}
    assert isinstance(install(tmp_path / "env", local)[-1], Done)
    assert verify(python_of(tmp_path / "env"), local) == [] and not (tmp_path / "elsewhere").exists()


def test_an_environment_of_an_older_wildcap_is_brought_up_to_date(local, made_before, tmp_path):
    folder = tmp_path / "env"
    assert isinstance(install(folder, local)[-1], Done)
    (folder / installation.COMPUTE_FILE).write_text("cpu pytorch older_lock.txt")
    (local / "worker.txt").write_text("tinytorch==2.0\n")
    assert verify(python_of(folder), local) == ["tinytorch is 1.0, not 2.0."]
    write_lock(local, write_wheel(tmp_path / "wheels", "tinytorch", "2.0"))
    assert isinstance(install(folder, local)[-1], Done)
    assert verify(python_of(folder), local) == []


def test_an_environment_whose_files_are_gone_is_repaired(local, made_before, tmp_path):
    folder = tmp_path / "env"
    assert isinstance(install(folder, local)[-1], Done)
    (module,) = folder.rglob("tinytorch.py")
    module.unlink()
    told = verify(python_of(folder), local, importing=True)
    assert told == ["tinytorch does not load: ModuleNotFoundError: No module named 'tinytorch'."]
    assert isinstance(install(folder, local)[-1], Done)
    assert verify(python_of(folder), local, importing=True) == []


def test_a_package_that_is_another_file_is_refused(local, made_before, tmp_path):
    with zipfile.ZipFile(tmp_path / "wheels" / "tinynets-1.0-py3-none-any.whl", "a") as wheel:
        wheel.writestr("not_locked.py", "print('not what was locked')")
    final = install(tmp_path / "env", local)[-1]
    assert isinstance(final, Failed) and "its hash is another" in final.problem
    assert not list((tmp_path / "env").rglob("not_locked.py"))


def test_what_cannot_be_loaded_after_two_tries_is_told(local, made_before, tmp_path):
    with zipfile.ZipFile(tmp_path / "wheels" / "broken-1.0-py3-none-any.whl", "w") as wheel:
        wheel.writestr("broken.py", "raise OSError('no such library')")
        wheel.writestr("broken-1.0.dist-info/METADATA", "Metadata-Version: 2.1\nName: broken\nVersion: 1.0\n")
        wheel.writestr(
            "broken-1.0.dist-info/WHEEL",
            "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        )
        wheel.writestr("broken-1.0.dist-info/RECORD", "")
    (local / "worker.txt").write_text("broken==1.0\n")
    write_lock(local, tmp_path / "wheels" / "broken-1.0-py3-none-any.whl")
    for _ in range(2):
        final = install(tmp_path / "env", local)[-1]
        assert (
            isinstance(final, Failed)
            and final.problem == "broken does not load: OSError: no such library."
            and "install.log" in final.remedy
        )


def test_a_cancelled_installation_says_so(local, tmp_path):
    task = installation.installation(
        tmp_path / "env", local, tmp_path / "install.log", None, installation.PackageSource()
    )
    task.start()
    task.cancel()
    assert isinstance(follow(task)[-1], Cancelled)


def test_what_an_installation_brings_is_known_before_it_begins(local, made_before, tmp_path):
    def work(task, run=None):
        return index.plan_installation(local, installation.base_python(), "cpu", "pytorch", run or task.run, task.say)

    task = BackgroundTask("index", work)
    task.start()
    messages = follow(task)
    assert isinstance(messages[-1], Done), messages[-1]
    wheels = sorted((tmp_path / "wheels").iterdir())
    plan = task.result
    assert plan.packages == {"tinytorch": "1.0", "tinynets": "1.0"} and plan.hosts == ("this disk",)
    assert plan.download == sum(wheel.stat().st_size for wheel in wheels)
    assert plan.disk == 3 * plan.download > 0
    assert index.check_space(plan, tmp_path / "not" / "there") > plan.needed
    commands: list[list[str]] = []
    work(task, lambda command: commands.append(list(map(str, command))) or BackgroundTask.run(task, command))
    assert len(commands) == 2 and all("--require-hashes" in command for command in commands), (
        "nothing that runs here comes unchecked, pip's own update neither"
    )
    assert str(local / "locks" / "pip.txt") in commands[0]
    huge = replace(plan, disk=1 << 60)
    with pytest.raises(Problem, match="are needed while"):
        index.check_space(huge, tmp_path)
    with pytest.raises(Problem, match=r"did not answer as expected \(No matching distribution\)"):
        work(
            task,
            lambda command: (
                (1, "ERROR: No matching distribution.") if "--report" in command else BackgroundTask.run(task, command)
            ),
        )
    wheels[0].unlink()
    task = BackgroundTask("index", work)
    task.start()
    assert "did not answer as expected" in follow(task)[-1].problem


@pytest.mark.parametrize("at", range(4))
def test_a_removal_that_is_ended_at_any_file_can_be_asked_for_again(tmp_path, at):
    folder, elsewhere = tmp_path / "solver", tmp_path / "theirs"
    (folder / "lib" / "packages").mkdir(parents=True)
    elsewhere.mkdir()
    (elsewhere / "mine.txt").write_text("mine")
    for name in ("lib/packages/a.py", "pyvenv.cfg", COMPUTE_FILE):
        (folder / name).write_text("")
    (folder / "lib64").symlink_to(elsewhere, target_is_directory=True)
    left = iter(range(at))

    def check() -> None:
        if next(left, None) is None:
            raise CancelledError("environment")

    with pytest.raises(CancelledError):
        remove(folder, check)
    assert (folder / COMPUTE_FILE).is_file()
    task = removal(folder)
    task.start()
    assert isinstance(follow(task)[-1], Done) and not folder.exists() and (elsewhere / "mine.txt").is_file()


def test_other_peoples_folders_are_left_alone(local, tmp_path):
    mine = tmp_path / "photos"
    mine.mkdir()
    (mine / "a.jpg").write_bytes(b"1")
    with pytest.raises(Problem, match="other files"):
        installation.installation(mine, local, tmp_path / "log", None, installation.PackageSource())
    (mine / "pyvenv.cfg").write_text("home = /usr/bin")  # an environment of somebody else's
    with pytest.raises(Problem, match="other files"):
        installation.installation(mine, local, tmp_path / "log", None, installation.PackageSource())
    with pytest.raises(Problem, match="no environment that WildCap made"):
        remove(mine)
    assert (mine / "a.jpg").is_file()


def test_an_environment_that_was_half_made_is_made_anew(local, tmp_path):
    folder = tmp_path / "env"
    (folder / "lib" / "half").mkdir(parents=True)
    (folder / installation.COMPUTE_FILE).write_text("")
    assert isinstance(install(folder, local)[-1], Done)
    assert not (folder / "lib" / "half").exists() and (folder / installation.COMPUTE_FILE).read_text()
