# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Retouch as an artist does it: a layer by its button, strokes on the head, healing, undo and redo through all of them,
leaving; the worker lays the layer over the 4K maps, the head wears them; it is kept through a new solve, and
delivered."""

import json
import time
from pathlib import Path

import addon
import bpy
import driver as d
import numpy as np
from painting import dab, in_hand, uv_under

LIMIT_S = 1500


def flow():
    addon.unfold("WILDCAP_PT_retouch")
    root = yield from addon.open_sample_head()
    addon.use_solver()
    addon.draft(steps=20, checkpoint_every=20)
    addon.settings().deliver.size = "1024"
    bpy.context.scene.wildcap.layer_side = "1024"
    yield from solved(root, seed=0)
    began = time.monotonic()
    bpy.ops.wildcap.layer_add('EXEC_DEFAULT', True, map='albedo')  # as its button does: with a step of undo
    yield from in_hand()
    brush = bpy.context.scene.tool_settings.image_paint.brush
    brush.color, brush.size, brush.strength = (0.05, 0.02, 0.02), 16, 1.0
    x, y = d.middle()
    place = uv_under(bpy.data.objects["sample_head"], (x - 60, y - 60))
    states = [canvas()]
    for step, name in (
        (spot(x - 60, y - 60), ""),
        (spot(x + 55, y - 75), "retouch_painted"),
        (button("wildcap.layer_heal"), "retouch_healed"),
    ):
        yield from step
        states.append(canvas())
        if name:
            d.screenshot(name)
    changes = [np.abs(a - b).max() for a, b in zip(states, states[1:], strict=False)]
    assert min(changes) > 0.02, f"each of them changed the map: {changes}"
    yield from walk(states[::-1], "Ctrl-Z", ctrl=True)
    yield from walk(states, "Ctrl-Shift-Z", ctrl=True, shift=True)
    yield from button("wildcap.layer_brush", "BELOW")
    yield from button("wildcap.layer_brush", "DRAW")
    yield from spot(x - 60, y - 60)
    yield from d.lead("wildcap.finish_mask")
    yield from d.until(lambda: bpy.context.mode == 'OBJECT', "leaving", 10)
    layer = root / "retouch" / "Albedo.png"
    yield from d.until(layer.is_file, "the layer", 10)
    assert not [image for image in bpy.data.images if image.name.startswith("WildCap Retouch")]
    painting_s = time.monotonic() - began
    yield from retouched(root)
    d.say(f"painted and left after {painting_s:.0f} s, worn after {time.monotonic() - began:.0f} s, 6 clicks")
    d.screenshot("retouch_worn")
    mark = layer.read_bytes()
    yield from solved(root, seed=3)
    assert layer.read_bytes() == mark
    row, column = int((1 - place[1]) * 1024), int(place[0] * 1024)
    shown = pixels(root / "maps_retouched" / "diffuse_albedo.png", 1024)[row, column]
    assert shown.max() < 0.4, f"the painted spot is in the maps of the new solve: {shown}"
    bpy.ops.wildcap.deliver('EXEC_DEFAULT')
    target = root / "exports" / "sample_head_head_blender_gltf"
    found = lambda: next(iter((root / "exports").glob("*/provenance.json")), None)  # noqa: E731
    yield from d.until(lambda: found() or addon.problem(root), "the delivery", 600)
    assert found(), addon.problem(root)
    told = json.loads(found().read_text())["retouch"]
    assert len(told) == 1 and told[0]["map"] == "albedo", (target, told)
    d.say("delivered with", told)


def canvas() -> np.ndarray:
    image = bpy.data.images["WildCap Retouch"]
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return np.flipud(values.reshape(image.size[1], image.size[0], 4)[..., :3]).copy()


def pixels(path: Path, side: int) -> np.ndarray:
    image = bpy.data.images.load(str(path), check_existing=False)
    image.colorspace_settings.is_data = True
    image.scale(side, side)
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    found = np.flipud(values.reshape(side, side, -1)[..., :3]).copy()
    bpy.data.images.remove(image)
    return found


def spot(x: float, y: float):
    yield from dab(x, y)
    yield 0.3


def button(command: str, options: str = ""):
    yield from d.press(command, options)
    yield 0.5


def walk(states, name: str, **keys):
    """Press the key until the last state is reached, through every one in order."""
    at = 0
    while at < len(states) - 1:
        for _ in range(3):
            yield from d.key('Z', **keys)
            yield 0.4
            if np.abs(canvas() - states[at + 1]).max() < 1e-4:
                break
        else:
            nearest = [round(float(np.abs(canvas() - state).max()), 3) for state in states]
            raise AssertionError(f"{name}: state {at + 1} is not reached: {nearest}")
        at += 1
    assert bpy.context.mode == 'PAINT_TEXTURE'
    d.say(f"{name}: all states")


def retouched(root: Path):
    """The worker has laid the layers over the maps, and the head wears them."""
    made = root / "maps_retouched" / "diffuse_albedo.png"
    yield from d.until(lambda: made.is_file() and addon.job(root) is None or addon.problem(root), "the maps", 900)
    assert made.is_file(), addon.problem(root)
    image = lambda: bpy.data.materials[0].node_tree.nodes["WildCap Albedo"].image  # noqa: E731
    yield from d.until(lambda: worn() == made, f"the head wearing them instead of {worn()}, {image}", 30)


def worn() -> Path | None:
    material = addon.head().data.materials[0]
    node = material.node_tree.nodes.get("WildCap Albedo")
    return None if node is None or node.image is None else Path(bpy.path.abspath(node.image.filepath))


def solved(root: Path, seed: int):
    """A solve to its end, with the maps of another seed."""
    before = (root / "maps" / "diffuse_albedo.png").read_bytes()
    addon.settings().seed = seed
    bpy.ops.wildcap.solve('EXEC_DEFAULT')
    yield from d.until(lambda: addon.job(root) is None, "a solve", 900)
    assert (root / "maps" / "diffuse_albedo.png").read_bytes() != before, addon.problem(root)
