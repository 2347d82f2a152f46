# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head to deliver, and Deliver clicked."""

import json
from pathlib import Path

import pytest


@pytest.fixture
def capture(addon, tmp_path, monkeypatch):
    """A solved capture whose head is in the scene, turned and with two shape keys that are in use; jobs run here at
    once."""
    import bpy
    from mathutils import Vector

    from core.capture.messages import Done
    from tests.fixtures import delivered

    capture = delivered.make(tmp_path / "face.wildcap")
    bpy.ops.wildcap.open_capture(directory=str(capture.root))
    bpy.ops.wildcap.bring_in_head()
    head = bpy.context.view_layer.objects.active
    head.location, head.rotation_euler = (1, 2, 3), (0.1, 0.2, 0.3)
    head.shape_key_add(name="Basis")
    for name, move in delivered.KEYS.items():
        key = head.shape_key_add(name=name, from_mix=False)
        key.value = 0.7
        for point in list(key.data)[delivered.MOVED]:
            point.co += Vector(move)

    def start(item, tool, goal, *, then, at, ended, **shared):
        last = delivered.deliver(at, **shared["deliver"])
        ended()
        assert isinstance(last, Done), last
        then()

    monkeypatch.setattr(addon("jobs"), "start_tool", start)
    return capture


@pytest.fixture
def deliver(capture):
    """Click Deliver with these settings; return the folder it made."""
    import bpy

    def blocks() -> list[int]:
        kinds = ("objects", "meshes", "materials", "images", "scenes", "shape_keys", "hair_curves")
        return [len(getattr(bpy.data, kind)) for kind in kinds]

    def click(**settings) -> Path:
        group = bpy.context.scene.wildcap.captures[0].deliver
        for name, value in settings.items():
            setattr(group, name, value)
        before = blocks()
        assert bpy.ops.wildcap.deliver() == {'FINISHED'}
        assert blocks() == before and bpy.context.window.scene.name != "WildCap Delivery", "nothing stays in the .blend"
        (made,) = capture.exports.iterdir()
        text = (made / "provenance.json").read_text()
        record = json.loads(text)
        assert record["versions"]["Blender"] == bpy.app.version_string and str(capture.root) not in text
        assert f"textures/{sorted((made / 'textures').iterdir())[0].name}" in record["files"]
        assert not (made / "packing.json").exists()
        return made

    return click
