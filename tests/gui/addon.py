# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What flows ask of the add-on as it is installed: its modules, the sample head, the worker's Python, and settings by
which a solve takes seconds."""

import shutil
import sys
from pathlib import Path

import bpy
import driver as d

CHECKOUT = Path(__file__).resolve().parents[2]
INSTALLED = "bl_ext.user_default.wildcap"
START_LIMIT_S = 300
"""For a solver to reach its first step, on a loaded machine with two cores that draws the window, too."""


def module(name: str):
    """A module of the installed add-on, e.g. jobs or paint.session."""
    return sys.modules[f"{INSTALLED}.wildcap_addon.{name}"]


def unfold(*names: str) -> None:
    """Registers panels again as open ones, before any is drawn."""
    kinds = [getattr(bpy.types, name) for name in names]
    for kind in reversed(kinds):
        bpy.utils.unregister_class(kind)
    for kind in kinds:
        kind.bl_options = set()
        bpy.utils.register_class(kind)


def open_sample_head():
    """The tab, and the sample head by its button; returns the capture's folder."""
    yield from d.open_tab("WildCap")
    yield from d.press("wildcap.open_sample_head")
    yield from d.until(lambda: "sample_head" in bpy.data.objects, "the sample head", 20)
    yield 1.0
    return Path(head()["wildcap_capture"])


def open_to_deliver():
    """The sample head, the solver, and the panel Deliver unfolded at its smallest size; returns the capture's folder."""
    unfold("WILDCAP_PT_deliver")
    root = yield from open_sample_head()
    use_solver()
    settings().deliver.size = "1024"
    return root


def delivered(root: Path, target: Path):
    """Wait until the worker has written the maps, on a loaded machine, and the folder is there as a whole."""
    yield from d.until(lambda: target.is_dir() or problem(root), "the delivery", 600)
    assert target.is_dir(), problem(root)


def drop(folder: Path, *names: str):
    """Files dropped on the tab, by the operator that Blender calls for it: they become one capture."""
    d.act()
    with d.in_view('UI'):
        bpy.ops.wm.drop_import_file('INVOKE_DEFAULT', directory=str(folder), files=[{"name": name} for name in names])
    yield 1.0
    d.screenshot("drop_menu")
    yield from d.key('C')  # Blender asks: a reference, or Choose Video
    yield from d.until(lambda: len(bpy.context.scene.wildcap.captures) == 1, "one capture of what was dropped", 10)


def head():
    return bpy.data.objects.get("sample_head")


def use_solver() -> None:
    """The checkout's Python as the worker's; a file browser otherwise, which the flow one_button goes through."""
    bpy.ops.wildcap.use_python(filepath=str(CHECKOUT / ".venv"))


def settings():
    return bpy.context.scene.wildcap.captures[0]


def draft(steps: int, checkpoint_every: int, size: int = 128) -> None:
    """Minutes matter in a test, detail does not."""
    item = settings()
    item.quality = "draft"
    item.solve.size, item.solve.steps, item.solve.checkpoint_every = size, steps, checkpoint_every
    item.upscale.size = 1024
    item.transfer.scan = False


def unsolved(root: Path) -> None:
    """The sample head as a capture that is finished up to its mask."""
    for folder in ("maps", "maps_4k", "renders"):
        shutil.rmtree(root / folder, ignore_errors=True)


def job(root: Path):
    return module("jobs").of(str(root))


def worker_process(root: Path):
    """The process that works for the capture, to be watched or killed."""
    return job(root).worker._process


def continued(root: Path):
    """The large button is Continue Solving; a click on it, and the solver says from which step it goes on."""
    yield from d.until(
        lambda: next_step().label == "Continue Solving", f"the offer to continue instead of {next_step()}", 10
    )
    yield from d.lead("wildcap.solve")
    yield from d.until(
        lambda: job(root) is None or any("Going on after" in line for line in job(root).log),
        "going on from the checkpoint",
        START_LIMIT_S,
    )
    assert job(root) is not None, problem(root)
    d.say(next(line for line in job(root).log if "Going on after" in line))


def problem(root: Path | str = "") -> str:
    """What the tab says went wrong, '' for nothing."""
    found = module("problems").of(str(root))
    return f"{found.problem} {found.remedy}" if found else ""


def next_step():
    """What the tab's first lines say and offer."""
    return module("next_step").next_step(module("panel").gather(bpy.context, module("captures").active(bpy.context)))
