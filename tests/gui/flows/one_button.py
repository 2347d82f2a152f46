# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From a Blender without the add-on to a picture: the zip dragged in, a video chosen, Make My Head clicked, and nothing
painted; clicks and minutes are counted. by_name/button_by_button.py goes there by the single buttons.
"""

import addon
import driver as d
import own_head

LIMIT_S = 1700


def flow():
    started = yield from own_head.drag_in_zip()
    yield from own_head.choose_python()
    root = yield from own_head.choose_video()
    yield from own_head.begin("wildcap.make_my_head", root)
    yield 12.0
    d.screenshot("walk_3_making")
    yield from d.until(lambda: own_head.head() is not None or addon.job(root) is None, "the head in the scene", 1200)
    assert addon.job(root) is not None, addon.problem(root)
    d.say("the head comes in while it is solved")
    yield from own_head.ended("wildcap.make_my_head", root)
    yield from own_head.lit_face(root)
    own_head.count("one_button", started)
    d.screenshot("walk_4_rendered")
    assert "wildcap_skin" in own_head.head().data.materials[0], "the material came in by itself"
    assert not (root / "shadow_mask.png").is_file(), "nobody painted"
    assert addon.problem(root).startswith("Your head is ready."), addon.problem(root)
