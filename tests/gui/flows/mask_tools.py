# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes and buttons on the mask in any order: Ctrl-Z goes back through all of them, one by one, and Ctrl-Shift-Z forward again."""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import driver as d  # noqa: E402


def flow():
    yield from d.open_tab("WildCap")
    yield from d.park()
    yield from d.press("wildcap.open_sample_head")
    yield from d.until(lambda: "sample_head" in bpy.data.objects, "the sample head", 10)
    yield 1.5
    yield from d.press("wildcap.paint_mask")
    yield from d.until(lambda: bpy.context.mode == 'PAINT_TEXTURE', "texture painting", 5)
    yield 0.5
    x, y = d.middle()
    states = [mask()]
    for step in (button('MIRROR'), stroke(x + 30, y), button('GROW'), button('SHRINK'), stroke(x - 30, y - 60), button('INVERT'), button('CLEAR')):
        yield from step
        states.append(mask())
    assert all(np.abs(a - b).max() > 0.4 for a, b in zip(states, states[1:], strict=False)), "each of them changed the mask"
    d.screenshot("mask_tools")
    yield from walk(states[::-1], "Ctrl-Z", ctrl=True)
    yield from walk(states, "Ctrl-Shift-Z", ctrl=True, shift=True)
    assert bpy.context.mode == 'PAINT_TEXTURE'


def walk(states, name, **keys):
    """Presses the key until the last state is reached; every state must be passed, in order, and nothing else be seen."""
    at, presses = 0, []
    while at < len(states) - 1:
        presses.append(0)
        while True:
            yield from d.key('Z', **keys)
            presses[-1] += 1
            seen = mask()
            if np.abs(seen - states[at + 1]).max() < 0.01:
                at += 1
                break
            nearest = [round(float(np.abs(seen - state).max()), 2) for state in states]
            assert nearest[at] < 0.01, f"{name}: after {presses} presses per step the mask differs from its states by {nearest}"
            assert presses[-1] < 3, f"{name}: step {at} is never left"
    d.say(f"{name}: presses per step {presses}")


def stroke(x, y):
    yield from d.stroke([(x - 12 + 3 * i, y) for i in range(9)], ctrl=bool(mask().mean() > 0.5))


def button(kind):
    yield from d.press("wildcap.edit_mask", kind)
    yield 0.3


def mask() -> np.ndarray:
    """The mask being painted [H, W]. Data-blocks are looked up anew: an undo replaces them."""
    image = bpy.context.scene.tool_settings.image_paint.stencil_image
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(image.size[1], image.size[0], -1)[..., 0].copy()


d.play(flow(), limit_s=500)
