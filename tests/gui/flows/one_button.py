# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From a Blender without the add-on to a picture: the zip dragged in, a video chosen, Make My Head clicked, and nothing
painted; clicks and minutes are counted. by_name/button_by_button.py goes there by the single buttons.
"""

import driver as d
import own_head

LIMIT_S = 1700


def flow():
    started = yield from own_head.drag_in_zip()
    yield from own_head.choose_python()
    root = yield from own_head.choose_video()
    yield from own_head.make(root, "walk_3_making")
    yield from own_head.lit_face(root)
    own_head.count("one_button", started)
    d.screenshot("walk_4_rendered")
    assert "wildcap_skin" in own_head.head().data.materials[0], "the material came in by itself"
    assert not (root / "shadow_mask.png").is_file(), "nobody painted"
