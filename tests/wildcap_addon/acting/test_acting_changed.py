# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head with face units of which the artist cut something away since, as one does before joining it to a body: what is
left of it stays as it is."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
bmesh = pytest.importorskip("bmesh")
BVHTree = pytest.importorskip("mathutils.bvhtree").BVHTree

from tests.wildcap_addon.acting.test_acting import (  # noqa: E402, F401  (head is a fixture)
    coordinates,
    head,
    shown,
    write_head,
)

NECK_M = -0.12
"""Height below which the built-in head is neck."""


def cut_neck(head) -> None:  # noqa: F811
    bpy.ops.object.mode_set(mode='EDIT')
    mesh = bmesh.from_edit_mesh(head.data)
    bmesh.ops.delete(mesh, geom=[vertex for vertex in mesh.verts if vertex.co.z < NECK_M], context='VERTS')
    bmesh.update_edit_mesh(head.data)
    bpy.ops.object.mode_set(mode='OBJECT')


def places(head) -> dict[str, np.ndarray]:  # noqa: F811
    """Of the mesh and of each of its shape keys."""
    return {
        "": coordinates(head.data.vertices),
        **{key.name: coordinates(key.data) for key in head.data.shape_keys.key_blocks},
    }


@pytest.mark.parametrize("own_key", [False, True])
def test_a_head_whose_neck_was_cut_keeps_every_vertex_and_key_when_another_shape_comes(head, capture, own_key):  # noqa: F811
    if own_key:
        head.shape_key_add(name="Mine", from_mix=False).data[7].co.x += 0.01
    cut_neck(head)
    before, mesh, meshes = places(head), head.data, len(bpy.data.meshes)
    write_head(capture, 0.85)
    with pytest.raises(RuntimeError, match="changed since it got its face units"):
        bpy.ops.wildcap.bring_in_head()
    assert head.data == mesh and len(bpy.data.meshes) == meshes
    after = places(head)
    assert before.keys() == after.keys() and len(before) > 50
    assert all(np.array_equal(before[name], after[name]) for name in before)


def drivers(head) -> dict[str, str]:  # noqa: F811
    return {curve.data_path: curve.driver.expression for curve in head.data.shape_keys.animation_data.drivers}


@pytest.mark.parametrize("lost", ["a unit", "its neck"])
def test_gaze_and_close_up_of_such_a_head_stay_as_they_are(head, addon, lost):  # noqa: F811
    bpy.ops.wildcap.gaze()
    bpy.ops.wildcap.close_up()
    if lost == "a unit":
        head.shape_key_remove(head.data.shape_keys.key_blocks["tongueOut"])
    else:
        cut_neck(head)
    before, worn = drivers(head), {thing: thing.data for thing in addon("acting.close_up.building").of(head)}
    assert bpy.ops.wildcap.assemble_material() == {'FINISHED'}
    assert not addon("relight.material").is_edited(head)
    assert drivers(head) == before and len(worn) == 12
    assert {thing: thing.data for thing in addon("acting.close_up.building").of(head)} == worn
    assert bpy.ops.wildcap.gaze() == bpy.ops.wildcap.close_up() == {'FINISHED'}, "they can be taken away"
    assert addon("acting.gaze").of(head) is None and not addon("acting.close_up.building").of(head)
    for button in (bpy.ops.wildcap.gaze, bpy.ops.wildcap.close_up):
        with pytest.raises(RuntimeError, match="lost vertices or face units"):
            button()


def test_gaze_goes_though_a_unit_that_it_drove_is_gone(head, addon):  # noqa: F811
    bpy.ops.wildcap.gaze()
    key = head.data.shape_keys.key_blocks["eyeLookUpLeft"]
    key.driver_remove("value")  # or Blender itself may crash, evaluating it
    head.shape_key_remove(key)
    assert bpy.ops.wildcap.gaze() == {'FINISHED'} and addon("acting.gaze").of(head) is None
    assert head.data.shape_keys.key_blocks["eyeLookDownLeft"].slider_max == 1


def test_rest_works_without_the_slider_of_the_lids(head):  # noqa: F811
    keys = head.data.shape_keys
    del keys["eyesOpen"]
    keys.key_blocks["jawOpen"].value = 0.5
    assert bpy.ops.wildcap.rest_face() == {'FINISHED'} and keys.key_blocks["jawOpen"].value == 0


def test_what_fails_after_the_maps_are_in_does_not_pass_for_an_artists_edit(head, addon, monkeypatch):  # noqa: F811
    def fail(obj, capture):
        raise RuntimeError("no")

    monkeypatch.setattr(addon("head"), "COMPLETERS", [fail])
    head.data.materials[0].node_tree.nodes["WildCap Skin"].inputs["Roughness"].default_value = 0.31
    assert addon("relight.material").is_edited(head)
    with pytest.raises(RuntimeError, match="no"):
        bpy.ops.wildcap.assemble_material()
    assert not addon("relight.material").is_edited(head)


def test_an_undo_gives_the_iris_its_colour_back(head):  # noqa: F811
    """In the picture, of which Blender's undo takes back no pixels; and the one before can be chosen again."""
    name, material = head.name, head.data.materials[1].name

    def told_and_shown() -> tuple[str, bool]:
        image = bpy.data.materials[material].node_tree.nodes["WildCap Eye"].image
        red, _, blue, _ = image.pixels[4 * (256 * 512 + 305) :][:4]  # half way from the pupil to the iris' rim
        return image["wildcap_iris"], bool(blue > red)

    bpy.ops.wildcap.iris(iris='brown')
    bpy.ops.ed.undo_push(message="brown")
    images = len(bpy.data.images)
    bpy.ops.wildcap.iris(iris='blue')
    bpy.ops.ed.undo_push(message="blue")
    assert told_and_shown() == ("blue", True) and len(bpy.data.images) == images
    bpy.ops.ed.undo()
    assert told_and_shown() == ("brown", False)
    bpy.context.view_layer.objects.active = bpy.data.objects[name]
    bpy.ops.wildcap.iris(iris='blue')
    bpy.ops.wildcap.iris(iris='brown')
    assert told_and_shown() == ("brown", False)
    assert bpy.data.materials[material].node_tree.nodes["WildCap Eye"].image.name == f"{name} Eye"


def test_lids_keep_off_the_eyeballs_half_way(head, addon):  # noqa: F811
    """By half a millimetre; on a straight way from shut to open a lid would lie as deep within the cornea."""
    asset, keys = addon("acting.asset").load(), head.data.shape_keys
    skin = len(asset.template) + len(asset.copies)
    eyes = [[int(i) for i in face if i >= 0] for face in asset.faces[asset.slots == 1]]
    lids = coordinates(keys.key_blocks["eyesOpenLeft"].data) - coordinates(keys.reference_key.data)
    lids = np.flatnonzero(np.linalg.norm(lids[:skin], axis=1) > 3e-4)
    for opened, blink in ((0, 0), (0.25, 0), (0.5, 0), (0.75, 0), (1, 0), (1, 0.5), (1, 0.75)):
        keys["eyesOpen"], keys.key_blocks["eyeBlinkLeft"].value = float(opened), blink
        places = shown(head)
        ball = BVHTree.FromPolygons(places.tolist(), eyes)
        left = places[skin:][asset.kind == 1]
        centre = (left.max(0) + left.min(0)) / 2
        gaps = []
        for arm in places[lids] - centre:
            far = np.linalg.norm(arm)
            _, _, _, surface = ball.ray_cast(centre.tolist(), (arm / far).tolist())
            gaps += [far - surface] if arm[1] < -0.4 * far else []
        assert len(gaps) > 300 and min(gaps) > 2e-4, (opened, blink)
