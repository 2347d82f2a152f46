# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A batch of two faces: one Blender walks through their masks, starts Solve All and is closed; another finds the batch
at work, gets the first result, and stops it."""

import shutil
import tempfile
from pathlib import Path

import addon
import bpy
import driver as d
import numpy as np
import painting
import second

from core.batch import record
from core.capture import sample_head
from core.settings.settings import from_json, preset
from tests.fixtures import batch_faces
from tests.fixtures.recorded import finish_stages

LIMIT_S = 900

NAMES = ("anna", "bert")
QUICK = {
    "solve": {"size": 128, "steps": 4, "skin_tone": "0.69,0.54,0.45", "white_point": "1,1,1"},
    "upscale": {"size": 1024},
    "transfer": {"scan": False},
}


def flow():
    folder = Path(tempfile.mkdtemp())
    root = plan(folder / "batch")
    yield from d.open_tab("WildCap")
    blender = second.start("walk_and_quit", folder)
    told = yield from second.heard(blender, folder, "solving", 180 + addon.START_LIMIT_S)
    yield from d.until(lambda: blender.poll() is not None, "the end after File > Quit", 20)
    assert blender.poll() == 0 and batch_faces.alive(told["batch"]), "the batch outlives its Blender"
    yield from painting.kept(root / "anna.wildcap" / "shadow_mask.png", np.load(folder / "stroke.npy"), 1)
    yield from found(root)
    yield from result(root)
    yield from stopped(told["batch"])


def plan(root: Path) -> Path:
    """Two copies of the sample head, finished up to their masks, in a batch that waits for its artist."""
    faces, settings = [], from_json(QUICK, preset("draft"))
    for name in NAMES:
        sample_head.copy_to(root.parent).root.rename(root.parent / f"{name}.part")
        root.mkdir(exist_ok=True)
        shutil.move(root.parent / f"{name}.part", root / f"{name}.wildcap")
        addon.unsolved(root / f"{name}.wildcap")
        capture = batch_faces.filmed(root, name)
        finish_stages(capture, settings)
        faces.append(record.BatchFace(name, capture.source, capture.root, "draft", QUICK))
    record.write_batch(record.Batch(root, tuple(faces), "artist"))
    return root


def found(root: Path):
    """By itself, though no .blend knows of it; a click lists its faces."""
    batches = addon.module("batches")
    yield from d.until(
        lambda: batches.current() == root and batches.line(batches.view()), "finding the batch at work", 30
    )
    d.say("found:", batches.line(batches.view()))
    yield from d.park()
    yield from d.press("wildcap.open_batch")
    yield from d.until(lambda: len(bpy.context.scene.wildcap.captures) == 2, "the list of its faces", 10)
    bpy.context.scene.wildcap.active_index = 0
    yield 2.0
    d.screenshot("batch_3_found")
    assert addon.next_step().operator == "wildcap.cancel_batch", addon.next_step()


def result(root: Path):
    """The head comes in when its face is done, the maps by the next click."""
    yield from d.until(lambda: "anna" in bpy.data.objects, "the first face's head", addon.START_LIMIT_S)
    yield from d.until(
        lambda: addon.next_step().operator == "wildcap.assemble_material",
        f"its maps instead of {addon.next_step()}",
        20,
    )
    yield from d.lead("wildcap.assemble_material")
    yield 1.0
    assert "WildCap Skin" in bpy.data.objects["anna"].data.materials[0].node_tree.nodes
    d.screenshot("batch_4_result")


def stopped(pid: int):
    """The second face is in the solver's hands, and let go after a click."""
    yield from d.press("wildcap.cancel_batch")
    yield from d.until(lambda: not batch_faces.alive(pid), "the end of the batch", 10)
