# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Two Blenders at one capture: the second one's Solve is refused by name, and of what both paint nothing is lost."""

import tempfile
from pathlib import Path

import addon
import bpy
import driver as d
import numpy as np
import painting
import second


def flow():
    folder = Path(tempfile.mkdtemp())
    root = yield from addon.open_sample_head()
    addon.unsolved(root)
    addon.use_solver()
    addon.draft(steps=600, checkpoint_every=5)
    yield 1.5
    bpy.ops.wildcap.solve()
    yield from d.until(lambda: (root / "lock").is_file(), "the lock", 60)
    blender = second.start("refused_and_paint", folder)
    try:
        yield from refused(blender, folder, root)
        yield from both_paint(blender, folder, root)
    finally:
        blender.kill()
    bpy.ops.wildcap.cancel()
    yield from d.until(lambda: addon.job(root) is None, "the end", 5)


def refused(blender, folder: Path, root: Path):
    told = yield from second.heard(blender, folder, "refused", 120)
    worker = addon.worker_process(root).pid
    assert f"Another worker (process {worker}" in told["text"] and "Wait for it or cancel it there" in told["text"], (
        told
    )
    assert not told["job"] and addon.job(root) is not None
    d.say("the second Blender was told:", told["text"].strip())


def both_paint(blender, folder: Path, root: Path):
    """Each loaded the mask before the other painted; the later stroke is the capture's mask, the earlier ones are in
    the history."""
    yield from second.heard(blender, folder, "painting", 60)
    bpy.ops.wildcap.paint_mask()
    yield from painting.in_hand()
    x, y = d.middle()
    yield from painting.visible_dab(x + 60, y + 50)
    ours = painting.mask()
    yield from painting.kept(root / "shadow_mask.png", ours, 8)
    (folder / "paint.json").write_text("{}")
    yield from second.heard(blender, folder, "kept", 60)
    theirs = np.load(folder / "stroke.npy")
    assert np.abs(theirs - ours).max() > 0.4
    assert in_history(root, ours), "the first Blender's stroke went to the history"
    yield from painting.visible_dab(x + 60, y - 50)
    latest = painting.mask()
    yield from painting.kept(root / "shadow_mask.png", latest, 8)
    assert in_history(root, ours) and in_history(root, theirs), "and the second one's after it"
    d.say(f"neither stroke is lost: {len(list((root / 'mask_history').iterdir()))} masks in the history")
    yield from d.lead("wildcap.finish_mask")
    yield 0.5


def in_history(root: Path, mask: np.ndarray) -> bool:
    return any(
        np.abs(painting.on_disk(path) - mask).max() < 0.01 for path in (root / "mask_history").glob("shadow_mask_*.png")
    )
