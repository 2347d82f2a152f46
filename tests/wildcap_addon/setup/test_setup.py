# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The first steps in Blender: what is said before anything is installed or removed, and a Python that does not answer.
No network."""

import time
import venv

import pytest

bpy = pytest.importorskip("bpy")

from tests.fixtures.drawn import buttons  # noqa: E402


@pytest.fixture
def setup(addon, tmp_path):
    """The add-on's set-up with an empty solver folder in "Löser", Blender online, and nothing known."""
    preferences, asking = addon("preferences"), addon("asking")
    system = bpy.context.preferences.system
    preferences.get().environment, system.use_online_access = str(tmp_path / "Löser"), True
    asking._answers.clear()
    yield addon
    preferences.set_python(None)
    preferences.get().environment, system.use_online_access = "", False
    asking._answers.clear()


def follow(addon, limit_s: float = 60):
    end = time.monotonic() + limit_s
    while addon("jobs").poll():
        assert time.monotonic() < end
        time.sleep(0.02)


def wait(checking, limit_s: float = 60):
    end = time.monotonic() + limit_s
    while checking.look() is not None:
        assert time.monotonic() < end
        time.sleep(0.02)


def plan_of(addon, disk: int = 1_600_000_000):
    index = addon("setup.install").index
    return index.InstallationPlan(
        {"torch": "2.13.0", "numpy": "1.26.4", "av": "15.1.0"}, ("files.pythonhosted.org",), 430_000_000, disk
    )


def test_installing_asks_the_index_first_and_says_what_it_means(setup, monkeypatch, tmp_path):
    install, asking, jobs = setup("setup.install"), setup("asking"), setup("jobs")
    if not bpy.app.online_access:
        pytest.skip("this Blender cannot go online")
    asked = []
    monkeypatch.setattr(install, "look_up_plan", lambda task, *how: asked.append(how[:3]) or plan_of(setup))
    setup("preferences").get().compute = 'cpu'
    assert install.WILDCAP_OT_install_solver.tell() is None
    assert jobs.of("").goal == "ask" and not bpy.ops.wildcap.install_solver.poll()
    follow(setup)
    assert asked == [("cpu", "pytorch", None)]
    opened = asking.answer(("plan", "cpu", "pytorch", None))
    assert opened == plan_of(setup), "from now on the dialog opens at once"
    assert "the CPU" in install.WILDCAP_OT_install_solver.tell()[0] and jobs.of("") is None
    lines = install.describe_plan(plan_of(setup), "cpu", tmp_path / "Löser", 23_400_000_000)
    for words in (
        "PyTorch 2.13.0 for the CPU and 2 more packages",
        "0.4 GB to download from files.pythonhosted.org",
        "1.6 GB on disk",
        "Löser",
        "23.4 GB are free",
    ):
        assert any(words in line for line in lines), words


def test_a_disk_that_is_too_small_is_known_before_the_download(setup):
    if not bpy.app.online_access:
        pytest.skip("this Blender cannot go online")
    setup("preferences").get().compute = 'cpu'
    setup("asking")._answers["plan", "cpu", "pytorch", None] = plan_of(setup, disk=1 << 60)
    for click in (bpy.ops.wildcap.install_solver, setup("setup.install").WILDCAP_OT_install_solver.tell):
        with pytest.raises(Exception, match="are needed while the solver is installed"):
            click()
    assert setup("jobs").of("") is None and "another disk" in setup("problems").of("").remedy


def test_offline_nothing_is_asked(setup):
    bpy.context.preferences.system.use_online_access = False
    for click in (bpy.ops.wildcap.install_solver, setup("setup.install").WILDCAP_OT_install_solver.tell):
        with pytest.raises(Exception, match="work offline"):
            click()
    assert setup("jobs").of("") is None


def test_a_folder_of_wheels_needs_no_network(setup, tmp_path):
    install, preferences, asking = setup("setup.install"), setup("preferences"), setup("asking")
    bpy.context.preferences.system.use_online_access = False
    preferences.get().packages, preferences.get().compute = 'folder', 'cpu'
    try:
        for wheels, words in (("", "a folder that is not chosen"), (str(tmp_path), tmp_path.name)):
            preferences.get().wheels = wheels
            with pytest.raises(Exception, match="There are no wheels in") as refusal:
                install.WILDCAP_OT_install_solver.tell()
            assert words in str(refusal.value)
        (tmp_path / "a-1-py3-none-any.whl").touch()
        assert install.WILDCAP_OT_install_solver.tell() is None
        follow(setup)
        assert "did not answer as expected" in setup("problems").of("").problem, "it is looked for there"
        asking._answers["plan", "cpu", "folder", tmp_path] = plan_of(setup)
        assert "the CPU" in install.WILDCAP_OT_install_solver.tell()[0]
    finally:
        preferences.get().packages, preferences.get().wheels = 'pytorch', ""


def test_removing_adds_up_what_is_freed_and_takes_the_solver_off(setup, tmp_path):
    preferences, asking = setup("preferences"), setup("asking")
    folder = tmp_path / "Löser"
    assert not bpy.ops.wildcap.remove_solver.poll()
    venv.create(folder, with_pip=False, symlinks=True)
    (folder / "wildcap_compute.txt").write_text("cpu")
    (folder / "big.bin").write_bytes(bytes(3_000_000))
    preferences.set_python(folder / "bin" / "python")
    tell = setup("setup.install").WILDCAP_OT_remove_solver.tell
    assert tell() is None
    follow(setup)
    assert "frees 3 MB" in tell()[0]
    assert asking.answer(("size", str(folder))) == pytest.approx(3_000_000, rel=0.05)
    bpy.ops.wildcap.remove_solver()
    follow(setup)
    assert not folder.exists() and preferences.python() is None and preferences.get().python == ""
    folder.mkdir()
    (folder / "photo.jpg").write_bytes(b"1")
    with pytest.raises(RuntimeError, match="no environment that WildCap made"):
        bpy.ops.wildcap.remove_solver()
    assert (folder / "photo.jpg").is_file()


def test_the_set_up_offers_a_test_once_a_solver_answers_and_no_longer_when_it_does_not(setup, tmp_path, monkeypatch):
    preferences, checking, panel = setup("preferences"), setup("setup.checking"), setup("setup.panel").WILDCAP_PT_setup
    assert "wildcap.self_test" not in buttons(panel) and "wildcap.install_solver" in buttons(panel)
    bare = tmp_path / "bare"
    venv.create(bare, with_pip=False, symlinks=True)
    preferences.set_python(bare / "bin" / "python")
    assert "wildcap.self_test" in buttons(panel)
    checking._checks.clear()
    wait(checking)
    assert "wildcap.self_test" not in buttons(panel) and preferences.python() is None
    assert "torch" in setup("problems").of("").problem and setup("problems").of("").remedy
    monkeypatch.setattr(checking.environment, "judge", lambda found, requirements: [])
    found = {"device": "cuda", "reason": "cuda takes 0.1 s."}

    def survey(python, requirements, importing):
        return found if importing else {"device": "", "reason": ""}

    monkeypatch.setattr(checking.environment, "survey", survey)
    checking.accept(bare / "bin" / "python")
    assert "wildcap.self_test" in buttons(panel) and preferences.get().device == ""
    wait(checking)
    assert (
        preferences.get().device == "cuda"
        and preferences.get().device_reason == "cuda takes 0.1 s."
        and preferences.python() == bare / "bin" / "python"
    )
    checking._checks.clear()


def test_the_chosen_python_is_tried_in_the_background(setup, tmp_path):
    operators, preferences = setup("setup.operators"), setup("preferences")
    task = operators.BackgroundTask("setup", lambda task: operators.try_out(task, tmp_path / "none"))
    setup("jobs").start_worker("", "ask", task, lambda: setup("setup.checking").accept(tmp_path / "none"))
    follow(setup)
    assert "not a working Python" in setup("problems").of("").problem and preferences.python() is None
