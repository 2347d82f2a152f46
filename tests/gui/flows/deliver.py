# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample head delivered to Unreal: the preset chosen, Deliver clicked, its question answered, and the folder is
there as a whole."""

import json

import addon
import driver as d

LIMIT_S = 900


def flow():
    root = yield from addon.open_to_deliver()
    addon.settings().deliver.preset = "unreal"
    yield 1.0
    d.screenshot("deliver_1_panel")
    target = root / "exports" / f"{root.stem}_head_unreal_fbx"
    yield from d.press("wildcap.deliver")
    yield 1.0
    d.screenshot("deliver_2_question")
    yield from d.key('RET')
    yield from addon.delivered(root, target)
    told = json.loads((target / "provenance.json").read_text(encoding="utf-8"))
    files = set(told["files"])
    assert told["versions"]["Blender"] and {f"{root.stem}.fbx", f"textures/T_{root.stem}_N.png"} <= files, files
    assert not [path for path in target.parent.iterdir() if path.name.startswith(".")]
    yield from d.park()
    d.screenshot("deliver_3_done")
    assert addon.module("deliver.waiting").last(str(root)) == target
    d.say("delivered", *sorted(told["files"]))
