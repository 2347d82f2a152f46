# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender that is killed, or closed, while its solver runs and its mask is painted: no stroke is lost, and no
worker outlives it."""

import tempfile
import time
from pathlib import Path

import addon
import driver as d
import numpy as np
import painting
import second

from tests.fixtures import batch_faces

LIMIT_S = 900

LATER_S = 6.0
"""By the issue: this long after a stroke a kill loses nothing."""


def flow():
    folder = Path(tempfile.mkdtemp())
    root = yield from addon.open_sample_head()
    addon.unsolved(root)
    addon.use_solver()
    addon.draft(steps=600, checkpoint_every=1)
    yield from killed_after_a_stroke(root, folder / "stroke")
    yield from closed_after_a_stroke(root, folder / "quit")


def killed_after_a_stroke(root: Path, folder: Path):
    blender = second.start("solve_and_paint", folder)
    told = yield from second.heard(blender, folder, "stroked", 120)
    yield LATER_S
    blender.kill()
    yield from ended(told["worker"])
    assert blender.wait(5) == -9
    yield from same(root, folder)
    d.say(f"killed {LATER_S:.0f} s after a stroke: it is in the capture")


def closed_after_a_stroke(root: Path, folder: Path):
    blender = second.start("solve_and_quit", folder)
    told = yield from second.heard(blender, folder, "stroked", 120)
    yield from d.until(lambda: blender.poll() is not None, "the end after File > Quit", 20)
    assert blender.poll() == 0, blender.poll()
    yield from ended(told["worker"])
    yield from same(root, folder)
    d.say("closed in the moment of a stroke: it is in the capture")
    yield from d.until(
        lambda: addon.next_step().label == "Solve",
        f"a solve anew, of the mask with the stroke, instead of {addon.next_step()}",
        10,
    )


def ended(pid: int):
    """The worker hears by the end of its stdin that its Blender is gone."""
    started = time.monotonic()
    yield from d.until(lambda: not batch_faces.alive(pid), f"the end of the worker {pid}", 5)
    d.say(f"the worker ended within {time.monotonic() - started:.1f} s")


def same(root: Path, folder: Path):
    yield from painting.kept(root / "shadow_mask.png", np.load(folder / "stroke.npy"), 1)
