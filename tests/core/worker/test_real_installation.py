# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The solver installed for real, by the add-on's own operators, to its end: minutes and gigabytes, so only with
WILDCAP_REAL_INSTALLATION=pip (from where this machine's pip is set up to look), =pytorch (from PyTorch's own index), or
the path of a folder that `python -m core wheels` made, without a network. Run it with -s: it prints its figures."""

import os
import subprocess
import time

import pytest

bpy = pytest.importorskip("bpy")
SOURCE = os.environ.get("WILDCAP_REAL_INSTALLATION", "")

WHEELS = SOURCE if SOURCE and SOURCE not in ("pip", "pytorch") else ""

pytestmark = pytest.mark.skipif(
    not SOURCE, reason="installs gigabytes: WILDCAP_REAL_INSTALLATION=pip, =pytorch or =FOLDER_OF_WHEELS runs it"
)


@pytest.fixture
def solver(addon, tmp_path):
    """The folder the solver goes to, with spaces and accents."""
    preferences = addon("preferences").get()
    preferences.environment, preferences.compute = str(tmp_path / "Löser für Zoë" / "le solveur"), 'cpu'
    preferences.packages, preferences.wheels = 'folder' if WHEELS else SOURCE, WHEELS
    preferences.captures = str(tmp_path / "Köpfe")
    bpy.context.preferences.system.use_online_access = not WHEELS
    yield addon("preferences").environment_folder()
    addon("preferences").set_python(None)
    preferences.environment, preferences.packages, preferences.wheels, preferences.captures = "", 'pytorch', "", ""
    bpy.context.preferences.system.use_online_access = False


def follow(jobs, until=lambda job: False, limit_s: float = 1800) -> float:
    """Polls to the jobs' end or until the set-up's job is as wanted; the seconds it took."""
    started = time.monotonic()
    while jobs.poll() and not (jobs.of("") and until(jobs.of(""))):
        assert time.monotonic() - started < limit_s
        time.sleep(0.05)
    return time.monotonic() - started


def test_from_the_question_through_a_cancel_to_a_solve_and_removed_again(addon, solver):
    jobs, install, problems, checking = map(addon, ("jobs", "setup.install", "problems", "setup.checking"))
    if not bpy.app.online_access and not WHEELS:
        pytest.skip("this Blender cannot go online")
    assert install.WILDCAP_OT_install_solver.tell() is None
    asking_s = follow(jobs)
    assert problems.of("") is None, problems.of("")
    told = install.WILDCAP_OT_install_solver.tell()
    plan = addon("asking").answer(("plan", *install.chosen_packages()))

    bpy.ops.wildcap.install_solver()
    follow(jobs, lambda job: job.progress is not None and job.progress.done >= 8)
    bpy.ops.wildcap.cancel()
    cancel_s = follow(jobs)
    assert problems.of("").problem == "Cancelled." and cancel_s < 2 and addon("preferences").python() is None
    begun = (solver / "pyvenv.cfg").stat().st_mtime_ns

    bpy.ops.wildcap.install_solver()
    install_s = follow(jobs)
    log = solver.with_name(f"{solver.name}.wildcap-install.log").read_text(encoding="utf-8")
    assert problems.of("") is None, (problems.of(""), log[-2000:])
    assert (solver / "pyvenv.cfg").stat().st_mtime_ns == begun, "the second installation continues the first"
    python = addon("preferences").python()
    assert python is not None and solver in python.parents
    while checking.look() is not None:
        time.sleep(0.05)
    assert addon("preferences").python() == python and addon("preferences").get().device == "cpu", problems.of("")
    doctor = subprocess.run([python, "-m", "core", "doctor"], cwd=jobs.ROOT, capture_output=True, text=True)
    assert doctor.returncode == 0 and "Nothing is missing." in doctor.stdout, doctor.stdout

    bpy.ops.wildcap.open_sample_head()
    item = bpy.context.scene.wildcap.captures[-1]
    item.quality = 'draft'
    item.solve.size, item.solve.steps, item.upscale.size = 128, 6, 1024
    item.transfer.size, item.transfer.scan = 256, False
    bpy.ops.wildcap.solve()
    solve_s = follow(jobs)
    capture = addon("captures").folder(item)
    assert problems.of(str(capture.root)) is None and capture.read()["stages"]["solve"]["settings"]["steps"] == 6

    assert install.WILDCAP_OT_remove_solver.tell() is None
    follow(jobs)
    size, freed = addon("asking").answer(("size", str(solver))), install.WILDCAP_OT_remove_solver.tell()
    bpy.ops.wildcap.remove_solver()
    remove_s = follow(jobs)
    assert not solver.exists() and addon("preferences").python() is None and problems.of("") is None
    print(*told, *freed, sep="\n")
    print(f"{len(plan.packages)} packages, {plan.disk / 1e9:.2f} GB planned, {size / 1e9:.2f} GB on disk")
    print(
        f"ask {asking_s:.0f}, cancel {cancel_s:.1f}, install {install_s:.0f}, solve {solve_s:.0f}, remove {remove_s:.0f} s"
    )
    assert size == pytest.approx(plan.disk, rel=0.2)
