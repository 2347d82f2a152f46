# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes and buttons on the mask, on the head and on the sheet, in any order: Ctrl-Z goes back through all of them,
one by one, and Ctrl-Shift-Z forward again."""

import addon
import bpy
import driver as d
import numpy as np
from painting import dab, in_hand, mask

LIMIT_S = 500


def flow():
    yield from addon.open_sample_head()
    yield from d.press("wildcap.paint_mask")
    yield from in_hand()
    yield from mirrored()
    x, y = d.middle()
    states = [mask()]
    for step in (
        button('MIRROR'),
        stroke(x + 30, y),
        button('GROW'),
        button('SHRINK'),
        stroke(x - 30, y - 60, 'SHEET'),
        button('INVERT'),
        stroke(x + 20, y - 80, 'HEAD'),
        button('SOFTEN'),
        button('CLEAR'),
        button('PROPOSAL'),
    ):
        yield from step
        states.append(mask())
    changes = [np.abs(a - b).max() for a, b in zip(states, states[1:], strict=False)]
    assert min(changes) > 0.2, "each of them changed the mask"
    d.screenshot("mask_tools")
    yield from walk(states[::-1], "Ctrl-Z", ctrl=True)
    yield from walk(states, "Ctrl-Shift-Z", ctrl=True, shift=True)
    assert bpy.context.mode == 'PAINT_TEXTURE'


def walk(states, name, **keys):
    """Presses the key until the last state is reached; every state must be passed, in order, and nothing else be
    seen."""
    at, presses, session = 0, [], addon.module("paint.session")
    while at < len(states) - 1:
        presses.append(0)
        while True:
            yield from d.key('Z', **keys)
            yield 0.3
            assert session.on_sheet() == ("Sheet" in bpy.context.object.name), "the tab says where the mask is painted"
            presses[-1] += 1
            seen = mask()
            if np.abs(seen - states[at + 1]).max() < 0.01:
                at += 1
                break
            nearest = [round(float(np.abs(seen - state).max()), 2) for state in states]
            assert nearest[at] < 0.01, (
                f"{name}: after {presses} presses per step the mask differs from its states by {nearest}"
            )
            assert presses[-1] < 3, f"{name}: step {at} is never left"
    d.say(f"{name}: presses per step {presses}")


def mirrored():
    """With the panel's tick for it a stroke is on both sides, on the head and on the sheet; without it on one."""
    x, y = d.middle()
    for on in ('HEAD', 'SHEET'):
        bpy.ops.wildcap.paint_mask(on=on)
        yield 0.5
        for both in (True, False):
            bpy.context.object.data.use_mirror_x = both
            bpy.ops.wildcap.edit_mask(kind='CLEAR')
            yield 0.3
            yield from dab(x + 50, y - 30)
            halves = [int((half > 0.5).sum()) for half in np.split(mask(), 2, axis=1)]
            d.say(
                f"a stroke to the right, {on}, {'mirrored' if both else 'plain'}: texels of the left and right half "
                f"{halves}"
            )
            assert halves[1] > 100 and (halves[0] > 100) == both
    bpy.ops.wildcap.paint_mask(on='HEAD')
    bpy.ops.wildcap.edit_mask(kind='PROPOSAL')
    yield 0.5


def stroke(x, y, on: str = ''):
    """A dab, after a turn to the sheet or to the head."""
    if on:
        yield from d.press("wildcap.paint_mask", on)
        yield 0.5
    yield from dab(x, y, ctrl=bool(mask().mean() > 0.5))


def button(kind):
    yield from d.press("wildcap.edit_mask", kind)
    yield 0.3
