# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the eyes look at: an empty, wherever it is moved, as far as eyes turn."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
mathutils = pytest.importorskip("mathutils")

from tests.fixtures.acting_heads import (  # noqa: E402
    COPIES,
    HEAD,
    SIDES,
    capture_of,
    coordinates,
    degrees,
    evaluated,
    shown,
    things,
    towards,
    write_head,
)
from tests.fixtures.refused import refuses  # noqa: E402

TARGETS = ((0, 0), (16, 0), (-16, 0), (0, 9), (0, -14), (-12, -10))


@pytest.fixture
def empty(head, addon):
    assert bpy.ops.wildcap.gaze() == {'FINISHED'}
    return addon("acting.gaze").of(head)


def looks(head, asset) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return centre and direction of the left and the right eye, from the ball's vertices as they are shown."""
    eyes, vertices = [], shown(head)
    for kind in (1, 2):
        inner = np.flatnonzero(asset.kind == kind)
        ball = coordinates(head.data.shape_keys.reference_key.data)[HEAD + COPIES + inner]
        centre = (ball.max(0) + ball.min(0)) / 2
        pupil = inner[np.linalg.norm(asset.uvs[inner] - 0.5, axis=1).argmin()]
        eyes.append((centre, vertices[HEAD + COPIES + pupil] - centre))
    return eyes


def close_up_looks(head) -> list[tuple[np.ndarray, np.ndarray]]:
    matrices = [np.array(evaluated(things(head)[f"{side} Eye"]).matrix_local) for side in SIDES]
    return [(matrix[:3, 3], -matrix[:3, 1]) for matrix in matrices]


def check_looks(head, empty, targets, look) -> None:
    """Move the empty to yaws and pitches, and hold what both eyes look at against it."""
    middle = np.mean([centre for centre, _ in look()], 0)
    for yaw, pitch in targets:
        empty.location = middle + 0.6 * towards(yaw, pitch)
        bpy.context.view_layer.update()
        for centre, direction in look():
            assert degrees(direction, np.array(empty.location) - centre) < 3.5, (yaw, pitch)


def drivers(head) -> list:
    curves = head.data.shape_keys.animation_data.drivers
    return [curve.driver for curve in curves if "eyeLook" in curve.data_path]


def test_both_eyes_look_at_the_empty_wherever_it_is(head, addon):
    asset = addon("acting.asset").load()
    before = looks(head, asset)
    bpy.ops.wildcap.gaze()
    empty = addon("acting.gaze").of(head)
    assert empty.parent == head
    bpy.context.view_layer.update()
    for (_, a), (_, b) in zip(before, looks(head, asset), strict=True):
        assert degrees(a * [0, 1, 1], b * [0, 1, 1]) < 1, "at first they look on as they did, but at one point"
    check_looks(head, empty, TARGETS, lambda: looks(head, asset))
    head.location, head.rotation_euler = (1, 2, 3), (0, 0, 1)
    check_looks(head, empty, TARGETS[-1:], lambda: looks(head, asset))
    assert len(drivers(head)) == 8
    assert all(driver.is_valid and driver.is_simple_expression for driver in drivers(head)), "they need no script"


def test_the_eyes_of_a_close_up_look_at_it_and_a_bone_can_hold_it(close_up, addon):
    bpy.ops.wildcap.gaze()
    empty = addon("acting.gaze").of(close_up)
    check_looks(close_up, empty, TARGETS, lambda: close_up_looks(close_up))
    holder = bpy.data.objects.new("Bone", None)
    bpy.context.scene.collection.objects.link(holder)
    close_up.location, close_up.scale = (1, 2, 3), (2, 2, 2)
    bpy.context.view_layer.update()
    holder.location = close_up.matrix_world @ mathutils.Vector((0.1, -0.5, 0.03))
    empty.constraints.new('COPY_LOCATION').target = holder
    bpy.context.view_layer.update()
    centre, direction = close_up_looks(close_up)[0]
    assert degrees(direction, np.array((0.1, -0.5, 0.03)) - centre) < 3.5
    for thing in things(close_up).values():
        for curve in thing.animation_data.drivers if thing.animation_data else []:
            assert curve.driver.is_valid and curve.driver.is_simple_expression


def test_a_second_click_gives_the_sliders_back_though_a_unit_is_gone(head, empty, addon):
    keys = head.data.shape_keys.key_blocks
    empty.location = (0.5, -0.3, 0.2)
    bpy.context.view_layer.update()
    assert keys["eyeLookDownLeft"].slider_max > 1 and keys["eyeLookOutLeft"].value > 0.5
    keys["eyeLookUpLeft"].driver_remove("value")  # or Blender itself may crash, evaluating it
    head.shape_key_remove(keys["eyeLookUpLeft"])
    assert bpy.ops.wildcap.gaze() == {'FINISHED'} and addon("acting.gaze").of(head) is None
    bpy.context.view_layer.update()
    assert keys["eyeLookOutLeft"].value == 0 and not drivers(head) and keys["eyeLookDownLeft"].slider_max == 1


def test_the_eyes_of_another_shape_look_at_it_too_and_a_click_brings_a_deleted_one_back(head, empty, addon):
    write_head(capture_of(head), 1.2)
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    check_looks(head, empty, ((11, 5),), lambda: looks(head, addon("acting.asset").load()))
    bpy.data.objects.remove(empty)
    assert bpy.ops.wildcap.gaze() == {'FINISHED'} and addon("acting.gaze").of(head) is not None


def test_a_driver_of_the_artists_is_not_taken_away(head, addon):
    key = head.data.shape_keys.key_blocks["eyeLookInRight"]
    key.driver_add("value").driver.expression = "0.3"
    refuses("eyeLookInRight", bpy.ops.wildcap.gaze)
    assert addon("acting.gaze").of(head) is None and [driver.expression for driver in drivers(head)] == ["0.3"]
