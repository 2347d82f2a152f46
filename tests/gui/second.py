# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A second Blender beside the one that runs a flow, in the same profile and on the same screen, at the same captures.

The flow calls `start` with the name of a part below, and the two speak by files in a folder: `tell` writes one, the
flow waits for it. Run by Blender, this file plays that part.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
import addon  # noqa: E402
import driver as d  # noqa: E402
import painting  # noqa: E402
from suite import BLENDER  # noqa: E402


def start(part: str, folder: Path) -> subprocess.Popen:
    """The second Blender, in a smaller window that leaves the first one's tab to be seen. What it prints goes into the
    flow's log."""
    folder.mkdir(parents=True, exist_ok=True)
    return subprocess.Popen([*BLENDER, "900", "700", "-P", Path(__file__).resolve(), "--", part, folder])


def heard(process: subprocess.Popen, folder: Path, name: str, limit_s: float):
    """Waits for a word of the second Blender; it must not have failed meanwhile. Returns what it told."""
    path = folder / f"{name}.json"
    yield from d.until(
        lambda: path.is_file() or process.poll() is not None, f"the second Blender's word {name}", limit_s
    )
    assert path.is_file(), f"the second Blender ended with {process.poll()}"
    return json.loads(path.read_text())


def solve_and_paint():
    """A stroke while its solver runs; it then waits to be killed."""
    root = yield from solving()
    yield from stroke(0)
    tell("stroked", worker=addon.worker_process(root).pid)
    yield 600.0


def solve_and_quit():
    """A stroke while its solver runs, and File > Quit at once."""
    root = yield from solving()
    yield from stroke(40)
    tell("stroked", worker=addon.worker_process(root).pid)
    bpy.ops.wm.quit_blender()
    yield 600.0


def walk_and_quit():
    """The folder's batch by the file browser, a stroke on the first of its masks, both accepted, all solved, and File >
    Quit at once."""
    addon.unfold("WILDCAP_PT_capture")
    batches, folder = addon.module("batches"), FOLDER / "batch"
    yield from d.open_tab("WildCap")
    addon.use_solver()
    yield from d.park()
    yield from d.press("wildcap.open_batch")
    yield from d.browse(folder)
    yield from d.until(lambda: len(batches.waiting()) == 2, "two masks that wait", 30)
    yield from d.press("wildcap.next_mask")
    yield from painting.in_hand()
    yield from stroke(0)
    d.screenshot("batch_1_walk")
    yield from d.press("wildcap.accept_mask")
    yield from d.until(
        lambda: addon.module("paint.session").root() == str(folder / "bert.wildcap"), "the second mask", 20
    )
    yield from painting.in_hand()
    yield from d.press("wildcap.accept_mask")
    yield from d.until(lambda: bpy.context.mode == 'OBJECT' and batches.ready() == 2, "all masks being looked at", 20)
    yield 1.0
    d.screenshot("batch_2_looked_at")
    yield from d.press("wildcap.solve_all")
    yield from d.until(lambda: batches.line(batches.view()) != "", "the batch's first word", addon.START_LIMIT_S)
    tell("solving", batch=json.loads((folder / "lock").read_text())["pid"])
    bpy.ops.wm.quit_blender()
    yield 600.0


def solving():
    """The sample head, and its solve under way."""
    root = yield from addon.open_sample_head()
    addon.use_solver()
    addon.draft(steps=600, checkpoint_every=1)
    yield 1.5
    bpy.ops.wildcap.solve()
    yield from d.until(lambda: addon.job(root) is None or addon.job(root).progress is not None, "its worker", 60)
    assert addon.job(root) is not None, addon.problem(root)
    return root


def stroke(offset: float):
    """Paints, and leaves the mask as it is then where the flow finds it, rows from the top."""
    if bpy.context.mode != 'PAINT_TEXTURE':
        bpy.ops.wildcap.paint_mask()
        yield from painting.in_hand()
    x, y = d.middle()
    yield from painting.visible_dab(x - 30 + offset, y - 40)
    np.save(FOLDER / "stroke.npy", painting.mask())


def tell(name: str, **what) -> None:
    path = FOLDER / f"{name}.json"
    path.with_suffix(".part").write_text(json.dumps(what))
    os.replace(path.with_suffix(".part"), path)


if __name__ == "__main__":
    PART, FOLDER = sys.argv[-2], Path(sys.argv[-1])
    d.play(globals()[PART](), limit_s=600)
