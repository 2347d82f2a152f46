# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A job of the real worker while its artist does other things: cancelled within two seconds and continued, gone on with
through an undo past its start and beside an autosave."""

import tempfile
import time
from pathlib import Path

import addon
import bpy
import driver as d

LIMIT_S = 900

CANCEL_LIMIT_S = 2.0
"""By the promise, from the click. Of up to four, for other programs may hold one up."""
_cancelled: list[float] = []


def flow():
    addon.unfold("WILDCAP_PT_stages")
    root = yield from addon.open_sample_head()
    addon.use_solver()
    addon.draft(steps=6000, checkpoint_every=1, size=256)  # it outlasts what is done meanwhile on a fast machine, too
    bpy.ops.wm.save_as_mainfile(filepath=str(root.parent / "project.blend"))
    yield 1.5
    yield from run_and_cancel(root)
    yield from addon.continued(root)
    yield from undo_past_start(root)
    yield from autosave(root)
    yield from cancelled(root)
    while min(_cancelled) > CANCEL_LIMIT_S and len(_cancelled) < 4:
        yield from addon.continued(root)
        yield from cancelled(root)
    assert min(_cancelled) < CANCEL_LIMIT_S, _cancelled


def run_and_cancel(root: Path):
    """The arrow beside the stage, progress in its row and in the bar, and the large button's Cancel."""
    yield from d.press("wildcap.solve")
    assert addon.job(root) is not None, addon.problem(root)
    yield from stepped(root, 2)
    yield 0.5
    d.screenshot("jobs_1_running")
    yield from cancelled(root)
    yield from d.park()
    yield 1.5
    d.screenshot("jobs_2_cancelled")
    assert "kept" in addon.problem(root)


def undo_past_start(root: Path):
    """Ctrl-Z to before the capture was in the scene, and forward again: the job takes no notice of it, and the tab
    tells of it in both."""
    for _ in range(8):
        yield from d.key('Z', ctrl=True)
    yield from d.until(lambda: len(bpy.context.scene.wildcap.captures) == 0, "the undo past the sample head", 10)
    yield from stepped(root, 1)
    yield from d.park()
    d.screenshot("jobs_3_undone")
    yield from d.find("wildcap.cancel", root.name)
    for _ in range(8):
        yield from d.key('Z', ctrl=True, shift=True)
    yield from d.until(lambda: len(bpy.context.scene.wildcap.captures) == 1, "the redo of the sample head", 10)
    yield from stepped(root, 1)
    assert addon.next_step().operator == "wildcap.cancel"
    d.say("undo past its start: the job goes on")


def autosave(root: Path):
    """Blender's own autosave, a minute after its interval was set, with the job running."""
    files = bpy.context.preferences.filepaths
    files.auto_save_time, files.use_auto_save_temporary_files = 1, True
    bpy.data.objects["Cube"].location.x += 1
    bpy.ops.ed.undo_push()
    started = time.time()
    folder = Path(tempfile.gettempdir())
    yield from d.until(
        lambda: any(path.stat().st_mtime > started for path in folder.glob("*autosave.blend")),
        f"an autosave in {folder}",
        100,
    )
    assert addon.job(root) is not None, addon.problem(root)
    d.say(f"autosaved after {time.time() - started:.0f} s, the job running")


def cancelled(root: Path):
    """Clicks Cancel, and takes the time until the worker is gone."""
    process = addon.worker_process(root)
    position = yield from d.find("wildcap.cancel")
    clicked = time.monotonic()
    yield from d.click(position)
    yield from d.until(
        lambda: addon.job(root) is None and process.poll() is not None, "the end after Cancel", 30, every_s=d.TICK_S
    )
    _cancelled.append(time.monotonic() - clicked)
    d.say(f"cancelled {_cancelled[-1]:.1f} s after the click")


def stepped(root: Path, steps: int):
    """Waits until the solver has gone that many steps on."""

    def step() -> float:
        assert addon.job(root) is not None, f"the job is gone: {addon.problem(root)}"
        progress = addon.job(root).progress
        return progress.done if progress is not None and progress.text.startswith("sampling") else -1

    yield from d.until(lambda: step() >= 0, "the first step", addon.START_LIMIT_S)
    first = step()
    yield from d.until(lambda: step() >= first + steps, f"{steps} more steps", addon.START_LIMIT_S)
