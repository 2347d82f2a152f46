# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the eyes look at: an empty, wherever it is moved, as far as eyes turn."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.wildcap_addon.acting.test_acting import (  # noqa: E402, F401  (head is a fixture)
    COPIES,
    HEAD,
    head,
    shown,
    write_head,
)


def looks(head, asset) -> list[tuple[np.ndarray, np.ndarray]]:  # noqa: F811
    """Centre and direction of the left and the right eye as they are seen, from the ball's vertices."""
    found, seen = [], shown(head)
    for kind in (1, 2):
        inner = np.flatnonzero(asset.kind == kind)
        rest = np.empty(3 * len(head.data.vertices), np.float32)
        head.data.shape_keys.reference_key.data.foreach_get("co", rest)
        ball = rest.reshape(-1, 3)[HEAD + COPIES + inner]
        centre = (ball.max(0) + ball.min(0)) / 2
        pupil = inner[np.linalg.norm(asset.uvs[inner] - 0.5, axis=1).argmin()]
        way = seen[HEAD + COPIES + pupil] - centre
        found.append((centre, way / np.linalg.norm(way)))
    return found


def degrees(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1, 1))))


def test_both_eyes_look_at_the_empty_wherever_it_is(head, addon):  # noqa: F811
    asset = addon("acting.asset").load()
    before = looks(head, asset)
    assert bpy.ops.wildcap.gaze() == {'FINISHED'}
    empty = addon("acting.gaze").of(head)
    assert empty.parent == head
    bpy.context.view_layer.update()
    for (_, a), (_, b) in zip(before, looks(head, asset), strict=True):
        assert degrees(a * [0, 1, 1], b * [0, 1, 1]) < 1, "at first they look on as they did, but at one point"
    middle = np.mean([centre for centre, _ in before], 0)
    for yaw, pitch in ((0, 0), (16, 0), (-16, 0), (0, 9), (0, -14), (12, 8), (-12, -10)):
        a, b = np.radians((yaw, pitch))
        empty.location = middle + 0.6 * np.array([np.sin(a) * np.cos(b), -np.cos(a) * np.cos(b), np.sin(b)])
        bpy.context.view_layer.update()
        for centre, way in looks(head, asset):
            assert degrees(way, np.array(empty.location) - centre) < 3.5, (yaw, pitch)
    head.location, head.rotation_euler = (1, 2, 3), (0, 0, 1)
    bpy.context.view_layer.update()
    eye, look = looks(head, asset)[0]
    assert degrees(look, np.array(empty.location) - eye) < 3.5, "it goes along with the head"


def test_no_driver_needs_a_script(head, addon):  # noqa: F811
    bpy.ops.wildcap.gaze()
    drivers = [curve.driver for curve in head.data.shape_keys.animation_data.drivers if "eyeLook" in curve.data_path]
    assert len(drivers) == 8 and all(driver.is_valid and driver.is_simple_expression for driver in drivers)


def test_a_second_click_gives_the_sliders_back(head, addon):  # noqa: F811
    rest = shown(head)
    bpy.ops.wildcap.gaze()
    addon("acting.gaze").of(head).location = (0.5, -0.3, 0.2)
    bpy.context.view_layer.update()
    assert np.abs(shown(head) - rest).max() > 1e-3
    bpy.ops.wildcap.gaze()
    bpy.context.view_layer.update()
    assert addon("acting.gaze").of(head) is None and np.abs(shown(head) - rest).max() < 1e-6
    key = head.data.shape_keys.key_blocks["eyeLookUpLeft"]
    key.value = 0.5
    assert key.value == 0.5


def test_the_eyes_of_another_shape_look_at_it_too(head, addon, capture):  # noqa: F811
    bpy.ops.wildcap.gaze()
    write_head(capture, 1.2)
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    empty = addon("acting.gaze").of(head)
    empty.location = (0.1, -0.5, 0.05)
    bpy.context.view_layer.update()
    for centre, way in looks(head, addon("acting.asset").load()):
        assert degrees(way, np.array(empty.location) - centre) < 3.5


def test_eyes_turn_as_far_as_the_guide_says(head, addon):  # noqa: F811
    """Outwards, inwards, up and down: in degrees from straight ahead, at the most that the units are driven to."""
    gaze = addon("acting.gaze")
    eye = gaze._eye(head, 0)
    most = {
        way: angle(eye.ahead, 1) + gaze.MOST_LOOK * (angle(eye.turned[way], 1) - angle(eye.ahead, 1))
        for way, angle in (("Out", gaze._yaw), ("In", gaze._yaw), ("Up", gaze._pitch), ("Down", gaze._pitch))
    }
    assert [round(abs(float(np.degrees(most[way])))) for way in ("Out", "In", "Up", "Down")] == [19, 17, 10, 15]


def test_a_driver_of_the_artists_is_not_taken_away(head, addon):  # noqa: F811
    key = head.data.shape_keys.key_blocks["eyeLookInRight"]
    key.driver_add("value").driver.expression = "0.3"
    with pytest.raises(RuntimeError, match="eyeLookInRight already has a driver of its own"):
        bpy.ops.wildcap.gaze()
    assert (
        addon("acting.gaze").of(head) is None
        and head.data.shape_keys.animation_data.drivers.find('key_blocks["eyeLookInRight"].value') is not None
    )


def test_an_empty_that_was_deleted_comes_back_by_a_click(head, addon):  # noqa: F811
    bpy.ops.wildcap.gaze()
    bpy.data.objects.remove(addon("acting.gaze").of(head))
    assert bpy.ops.wildcap.gaze() == {'FINISHED'} and addon("acting.gaze").of(head) is not None
