# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The first steps in Blender: what is said before anything is installed or removed, and a Python that does not answer.
No network."""

import venv
from pathlib import Path

import pytest

from tests.fixtures.drawn import buttons
from tests.fixtures.polled_jobs import follow, wait
from tests.fixtures.refused import refuses

bpy = pytest.importorskip("bpy")


@pytest.fixture
def setup(addon, tmp_path):
    """The add-on's set-up with an empty solver folder in "Löser", Blender online, and nothing known."""
    preferences, system = addon("preferences"), bpy.context.preferences.system
    preferences.get().environment, system.use_online_access = str(tmp_path / "Löser"), True
    preferences.get().compute = 'cpu'
    addon("asking")._answers.clear()
    yield addon
    preferences.set_python(None)
    preferences.get().environment, system.use_online_access = "", False
    preferences.get().packages, preferences.get().wheels = 'pytorch', ""
    addon("asking")._answers.clear()


@pytest.fixture
def online(setup):
    if not bpy.app.online_access:
        pytest.skip("this Blender cannot go online")


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> Path:
    """A Python without packages."""
    folder = tmp_path_factory.mktemp("bare")
    venv.create(folder, with_pip=False, symlinks=True)
    return folder / "bin" / "python"


def plan_of(addon, disk: int = 1_600_000_000):
    packages = {"torch": "2.13.0", "numpy": "1.26.4", "av": "15.1.0"}
    hosts = ("files.pythonhosted.org",)
    return addon("setup.install").index.InstallationPlan(packages, hosts, 430_000_000, disk)


def test_installing_asks_the_index_first_and_says_what_it_means(setup, online, monkeypatch, tmp_path):
    install, jobs, asked = setup("setup.install"), setup("jobs"), []
    monkeypatch.setattr(install, "look_up_plan", lambda task, *how: asked.append(how[:3]) or plan_of(setup))
    tell = install.WILDCAP_OT_install_solver.tell
    assert tell() is None and jobs.of("").goal == "ask" and not bpy.ops.wildcap.install_solver.poll()
    follow(setup)
    assert asked == [("cpu", "pytorch", None)]
    assert "the CPU" in tell()[0] and jobs.of("") is None, "from now on the dialog opens at once"
    lines = " ".join(install.describe_plan(plan_of(setup), "cpu", tmp_path / "Löser", 23_400_000_000))
    for words in ("2.13.0", "2 more", "0.4 GB", "files.pythonhosted.org", "1.6 GB", "Löser", "23.4 GB"):
        assert words in lines


def test_a_disk_that_is_too_small_is_known_before_the_download(setup, online):
    setup("asking")._answers["plan", "cpu", "pytorch", None] = plan_of(setup, disk=1 << 60)
    for click in (bpy.ops.wildcap.install_solver, setup("setup.install").WILDCAP_OT_install_solver.tell):
        refuses("are needed", click)
    assert setup("jobs").of("") is None and "another disk" in setup("problems").of("").remedy


def test_offline_nothing_is_asked(setup):
    bpy.context.preferences.system.use_online_access = False
    for click in (bpy.ops.wildcap.install_solver, setup("setup.install").WILDCAP_OT_install_solver.tell):
        refuses("work offline", click)
    assert setup("jobs").of("") is None


def test_a_folder_of_wheels_needs_no_network(setup, monkeypatch, tmp_path):
    install, preferences, asked = setup("setup.install"), setup("preferences").get(), []
    monkeypatch.setattr(install, "look_up_plan", lambda task, *how: asked.append(how[:3]) or plan_of(setup))
    tell = install.WILDCAP_OT_install_solver.tell
    bpy.context.preferences.system.use_online_access = False
    preferences.packages = 'folder'
    refuses("no wheels in a folder that is not chosen", tell)
    preferences.wheels = str(tmp_path)
    refuses(tmp_path.name, tell)
    (tmp_path / "a-1-py3-none-any.whl").touch()
    assert tell() is None
    follow(setup)
    assert asked == [("cpu", "folder", tmp_path)] and "the CPU" in tell()[0]


def test_removing_adds_up_what_is_freed_and_takes_the_solver_off(setup, tmp_path):
    preferences, asking, folder = setup("preferences"), setup("asking"), tmp_path / "Löser"
    remove, tell = bpy.ops.wildcap.remove_solver, setup("setup.install").WILDCAP_OT_remove_solver.tell
    assert not remove.poll()
    (folder / "bin").mkdir(parents=True)
    (folder / "bin" / "python").touch()
    (folder / "pyvenv.cfg").touch()
    (folder / "wildcap_compute.txt").write_text("cpu")
    (folder / "big.bin").write_bytes(bytes(3_000_000))
    preferences.set_python(folder / "bin" / "python")
    assert tell() is None
    follow(setup)
    assert "frees 3 MB" in tell()[0]
    assert asking.answer(("size", str(folder))) == pytest.approx(3_000_000, rel=0.05)
    remove()
    follow(setup)
    assert not folder.exists() and preferences.python() is None and preferences.get().python == ""
    folder.mkdir()
    (folder / "photo.jpg").write_bytes(b"1")
    refuses("no environment that WildCap made", remove)
    assert (folder / "photo.jpg").is_file()
    preferences.get().environment = ""
    assert preferences.environment_folder() == Path.home() / ".wildcap" / "solver", "a short path"


def test_the_set_up_offers_a_test_once_a_solver_answers_and_no_longer_when_it_does_not(setup, bare, monkeypatch):
    preferences, checking, panel = setup("preferences"), setup("setup.checking"), setup("setup.panel").WILDCAP_PT_setup
    assert "wildcap.self_test" not in buttons(panel) and "wildcap.install_solver" in buttons(panel)
    preferences.set_python(bare)
    assert "wildcap.self_test" in buttons(panel)
    checking._checks.clear()
    wait(lambda: checking.look() is None)
    assert "wildcap.self_test" not in buttons(panel) and preferences.python() is None
    assert "torch" in setup("problems").of("").problem and setup("problems").of("").remedy
    found = {True: {"device": "cuda", "reason": "cuda takes 0.1 s."}, False: {"device": "", "reason": ""}}
    monkeypatch.setattr(checking.environment, "judge", lambda found, requirements: [])
    monkeypatch.setattr(checking.environment, "survey", lambda python, requirements, importing: found[importing])
    checking.accept(bare)
    assert "wildcap.self_test" in buttons(panel) and preferences.get().device == ""
    wait(lambda: checking.look() is None)
    assert preferences.get().device == "cuda" and preferences.get().device_reason == "cuda takes 0.1 s."
    assert preferences.python() == bare
    checking._checks.clear()


def test_a_python_that_cannot_run_the_solver_is_refused_by_name_and_tried_in_the_background(setup, bare, tmp_path):
    operators, preferences, none = setup("setup.operators"), setup("preferences"), tmp_path / "none"
    refuses("There is no Python", operators.interpreter, tmp_path)
    refuses("torch .* is missing", bpy.ops.wildcap.use_python, filepath=str(bare.parent.parent))
    operators.try_out(none)
    follow(setup)
    assert "not a working Python" in setup("problems").of("").problem and preferences.python() is None
