# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Face units added by a click, hair grown, eyes and mouth for a close-up, and a render of all of it."""

from pathlib import Path

import addon
import bpy
import driver as d

SIDE, SAMPLES = 160, 16
END = 40
"""Turns of the wheel from one end of the sidebar to the other"""


def flow():
    addon.unfold("WILDCAP_PT_relight", "WILDCAP_PT_acting", "WILDCAP_PT_groom")
    root = yield from addon.open_sample_head()
    yield from d.scroll(END)
    d.screenshot("acting_before")
    yield from d.press("wildcap.add_face_units")
    yield from d.until(lambda: keys() is not None and len(keys().key_blocks) == 57, "the face units", 60)
    yield from d.scroll(END)
    yield from grow_hair()
    d.screenshot("acting_hair")
    d.say(", ".join(f"{len(thing.data.curves)} {thing.name}" for thing in hair()))
    yield from close_up()
    yield from render(root)


def grow_hair():
    yield from d.press("wildcap.grow_hair")
    yield from d.until(lambda: len(hair()) == 2, "brows and lashes", 30)
    yield 1.0
    skin = addon.head().active_material.node_tree.nodes["WildCap Albedo"].image
    assert skin.filepath.endswith("clean_albedo.png"), skin.filepath


def close_up():
    yield from d.press("wildcap.close_up")
    yield from d.until(lambda: len(things()) == 12, "the close-up's objects", 60)
    keys()["eyesOpen"], keys().key_blocks["jawOpen"].value = 1.0, 0.6
    keys().update_tag()
    yield 2.0
    d.screenshot("acting_close_up")


def render(root: Path):
    props, path = bpy.context.scene.wildcap, root / "renders" / "three_point.png"
    props.light, props.resolution, props.samples = 'three_point', SIDE, SAMPLES
    yield from d.scroll(-END)
    shown: set[str] = set()  # by name: when it has been rendered, the head leaves the scene again

    def look(scene, *_):
        shown.update(thing.name for thing in scene.collection.objects)

    bpy.app.handlers.render_pre.append(look)
    yield from d.press("wildcap.render")
    yield from d.until(path.is_file, "the render", 120)
    bpy.app.handlers.render_pre.remove(look)
    assert shown >= {thing.name for thing in (*hair(), *things())}, "the render leaves out what the head wears"
    (d.OUT / "acting_render.png").write_bytes(path.read_bytes())


def things() -> list:
    return [thing for thing in addon.head().children if "wildcap_close_up" in thing]


def hair() -> list:
    return [thing for thing in addon.head().children if thing.type == 'CURVES']


def keys():
    return addon.head().data.shape_keys
