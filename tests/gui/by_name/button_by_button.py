# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The way of flows/one_button.py as it was before Make My Head, and still can be gone: Reconstruct, a stroke on the
shadow mask, Solve, Assemble Material, Render, each by its own button. Clicks and minutes are counted in the same
manner."""

import addon
import bpy
import driver as d
import own_head
import painting

LIMIT_S = 1700


def flow():
    started = yield from own_head.drag_in_zip()
    yield from own_head.choose_python()
    root = yield from own_head.choose_video()
    yield from d.press("wildcap.reconstruct")
    assert addon.job(root) is not None, addon.problem(root)
    yield from own_head.ended("wildcap.reconstruct", root)
    yield 1.5
    yield from d.lead("wildcap.paint_mask")
    yield from painting.in_hand()
    before = painting.mask()
    x, y = d.middle()
    yield from painting.dab(x + 25, y - 20, ctrl=bool(before.mean() > 0.5))
    yield from d.lead("wildcap.finish_mask")
    yield from d.until(lambda: bpy.context.mode == 'OBJECT' and (root / "shadow_mask.png").is_file(), "leaving", 5)
    yield 1.5
    yield from own_head.begin("wildcap.solve", root)
    yield from own_head.ended("wildcap.solve", root)
    yield 1.5
    yield from d.lead("wildcap.assemble_material")
    yield 1.5
    yield from d.lead("wildcap.render")
    yield from own_head.lit_face(root)
    own_head.count("button_by_button", started)
