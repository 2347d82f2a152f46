# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The landmarks on the head: moved by the artist, kept in the capture, and those of each head its own."""

import json

import pytest

from core.capture.capture import Capture
from tests.fixtures import standin
from tests.fixtures.refused import refuses

bpy = pytest.importorskip("bpy")
POINTS = {"1": [0.0, -0.1, 0.0], "152": [0.0, -0.08, -0.1], "7": [0, 0, 0]}


def make_head(root):
    (root / "landmarks.json").write_text(json.dumps({"points": POINTS}), encoding="utf-8")
    bpy.ops.wildcap.open_capture(directory=str(root))
    bpy.ops.wildcap.bring_in_head()
    return bpy.context.view_layer.objects.active


def test_moved_landmarks_are_kept_and_the_head_is_fitted_to_them_again(addon, capture, monkeypatch):
    Capture(capture).set_source(capture.parent / "face.mp4")
    head = make_head(capture)
    bpy.ops.wildcap.show_landmarks()
    empties = {o["wildcap_landmark"]: o for o in bpy.data.collections["WildCap Landmarks"].objects}
    assert set(empties) == {1, 152} and "Chin" in empties[152].name
    head.location = (3, 2, 1)
    bpy.context.view_layer.update()
    place = tuple(empties[152].matrix_world.translation)
    assert place == pytest.approx((3, 1.92, 0.9), abs=1e-6), "they stay on the head"
    refuses("No landmark was moved", bpy.ops.wildcap.fit_landmarks)
    started = []
    monkeypatch.setattr(addon("jobs"), "start", lambda item, goal, **span: started.append(span))
    empties[152].location.z -= 0.004
    bpy.ops.wildcap.fit_landmarks()
    assert started == [{"first": "registration", "last": "shadow_mask"}]
    kept = json.loads((capture / "landmarks_artist.json").read_text(encoding="utf-8"))["points"]
    assert list(kept) == ["152"] and kept["152"] == pytest.approx([0, -0.08, -0.104], abs=1e-6)
    assert "WildCap Landmarks" not in bpy.data.collections
    bpy.ops.wildcap.show_landmarks()
    chin = bpy.data.collections["WildCap Landmarks"].objects["Chin Landmark"]
    assert chin.location.z == pytest.approx(-0.104, abs=1e-6)
    bpy.ops.wildcap.hide_landmarks()


def test_landmarks_that_were_moved_on_one_head_stay_when_another_ones_are_shown(addon, capture, tmp_path):
    shown = addon("reconstruct.landmarks").shown_landmarks
    heads = [make_head(root) for root in (capture, standin.make(tmp_path / "other.wildcap"))]
    first, second = bpy.context.scene.wildcap.captures
    bpy.context.view_layer.objects.active = heads[0]
    bpy.ops.wildcap.show_landmarks()
    bpy.data.collections["WildCap Landmarks"].name = "Mine"
    shown(first)[0].location.x += 0.01
    bpy.context.view_layer.objects.active = heads[1]
    assert not bpy.ops.wildcap.hide_landmarks.poll() and not shown(second)
    for _ in range(2):
        bpy.ops.wildcap.show_landmarks()
        assert len(shown(first)) == len(shown(second)) == 2
    assert shown(first)[0].location.x == pytest.approx(0.01)
    bpy.ops.wildcap.hide_landmarks()
    assert len(shown(first)) == 2 and not shown(second)
    bpy.context.view_layer.objects.active = heads[0]
    bpy.ops.wildcap.hide_landmarks()
    assert not shown(first)
