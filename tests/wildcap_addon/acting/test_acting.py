# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Face units on a head in Blender: at rest it is the head as solved, and what the artist did to it stays."""

import json

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
bmesh = pytest.importorskip("bmesh")
mathutils = pytest.importorskip("mathutils")
BVHTree = pytest.importorskip("mathutils.bvhtree").BVHTree

from tests.fixtures.acting_heads import (  # noqa: E402
    COPIES,
    HEAD,
    SIDES,
    TRIANGLES,
    capture_of,
    coordinates,
    shown,
    things,
    values,
    write_head,
)
from tests.fixtures.refused import refuses  # noqa: E402

NECK_M = -0.12
"""Height below which the built-in head is neck."""
EYE = {"centre": [0.029, 0.003, -0.002], "radius": 0.0145, "gaze": [0.28, -0.96, 0.0]}


@pytest.fixture
def open_eyed(capture, addon, few_units):
    """A capture that was filmed with open eyes, half as wide as MakeHuman opens them and looking to the left; its
    vertices at rest with open lids [N, 3], those that were filmed [M] and the solved head's [V, 3]."""
    solved = write_head(capture, 0.95)
    asset, carrying = addon("acting.asset").load(), addon("acting.carrying")
    rest, units = carrying.carried(asset, solved)
    for side in SIDES:
        rows, moves = units[f"eyesOpen{side}"]
        rest[rows] += 0.5 * moves
    sockets = np.flatnonzero((asset.kind == 0) & (asset.parts[:, 2] > -0.02))
    rows = np.concatenate([np.arange(HEAD), HEAD + np.flatnonzero(asset.seam > 0), HEAD + COPIES + sockets])
    (capture / "head_open.obj").write_text("".join("v {:.7f} {:.7f} {:.7f}\n".format(*place) for place in rest[rows]))
    eye = {**EYE, "openness": 0.5, "iris_radius": 0.0058, "views": 6}
    (capture / "eyes.json").write_text(json.dumps({"left": eye, "right": {**eye, "centre": [-0.029, 0.003, -0.002]}}))
    (capture / "maps" / "irises.json").write_text(json.dumps({"left": [0.1, 0.2, 0.4], "right": [0.12, 0.2, 0.38]}))
    return rest, rows, solved


def left_eye(addon) -> np.ndarray:
    """Return the rows of the left eye's vertices."""
    return HEAD + COPIES + np.flatnonzero(addon("acting.asset").load().kind == 1)


def eye_image(head):
    return head.data.materials[1].node_tree.nodes["WildCap Eye"].image


def rings(image) -> tuple[np.ndarray, np.ndarray]:
    """Return a ring of the iris [N, 4] and all of the white [M, 4]."""
    pixels = np.array(image.pixels[:]).reshape(512, 512, 4)
    radius = np.hypot(*(np.mgrid[:512, :512] + 0.5 - 256)) / 512
    return pixels[(radius > 0.1) & (radius < 0.13)], pixels[radius > 0.2]


def is_blue(ring: np.ndarray) -> float:
    return (ring[:, 2] > ring[:, 0]).mean()


def test_at_rest_it_is_the_head_that_was_solved(head, addon):
    solved, rest = write_head(capture_of(head), 0.95), shown(head)
    assert np.abs(rest[:HEAD] - solved).max() < 1e-6
    skin = values(head.data.loops, "vertex_index", kind=np.int32)[: 3 * TRIANGLES]
    assert skin.max() == HEAD + COPIES - 1, "the seams' lower side, and nothing from inside, became part of the skin"
    whole = addon("acting.asset").load().triangles.ravel()
    assert np.abs(rest[skin] - solved[whole]).max() < 1e-6, "the cut moved no triangle"
    assert head.data.materials[0].get("wildcap_skin")
    assert [m.name.split()[-1] for m in head.data.materials[1:]] == ["Eyes", "Mouth", "Teeth"]
    u = values(head.data.uv_layers["UVMap"].data, "uv", 2)[:, 0]
    tile = np.repeat([p.material_index for p in head.data.polygons], [p.loop_total for p in head.data.polygons])
    assert (u >= tile - 1e-6).all() and (u <= tile + 1 + 1e-6).all() and set(tile) == {0, 1, 2, 3}
    rough = values(head.data.attributes["wildcap_roughness"].data, "value")
    assert np.ptp(rough[:HEAD]) > 0.05 and np.ptp(rough[HEAD : HEAD + COPIES]) > 0.01
    assert not rough[HEAD + COPIES :].any()
    refuses("already", bpy.ops.wildcap.add_face_units)


def test_each_unit_of_the_eye_opens_its_lids_and_rest_closes_them(head):
    keys, rest = head.data.shape_keys, shown(head)
    skin = values(head.data.loops, "vertex_index", kind=np.int32)[: 3 * TRIANGLES]
    lids, blocks = np.unique(skin[skin >= HEAD]), keys.key_blocks
    blocks["eyeBlinkLeft"].value = 1
    assert np.abs(shown(head) - rest)[lids].max() < 1e-6, "shut they stay shut"
    blocks["eyeBlinkLeft"].value = 0
    keys["eyesOpen"] = 1.0
    wide = shown(head)
    assert np.abs(wide - rest)[:HEAD, 2].max() > 0.005
    blocks["eyeBlinkLeft"].value = 1
    shut = shown(head)
    assert np.abs(shut - rest)[rest[:, 0] > 0.005].max() < 1e-6
    assert np.abs(shut - wide)[rest[:, 0] < -0.005].max() < 1e-6
    bpy.ops.wildcap.rest_face()
    assert np.abs(shown(head) - rest).max() < 1e-6
    blocks["eyeLookUpRight"].value = 1
    assert np.abs(shown(head) - rest)[:HEAD, 2].max() > 0.005, "to look somewhere is to open the eye"
    del keys["eyesOpen"]
    assert bpy.ops.wildcap.rest_face() == {'FINISHED'} and blocks["eyeLookUpRight"].value == 0


def test_one_picks_and_paints_on_its_skin(head, addon):
    keys, rest = head.data.shape_keys, shown(head)
    keys["eyesOpen"] = 1.0
    keys.key_blocks["jawOpen"].value = 1
    shown(head)
    pick, eye = addon("solve.eyedropper").uv_on, mathutils.Vector(rest[left_eye(addon)].mean(0))
    look = head.matrix_world @ eye + mathutils.Vector((0, -1, 0)), mathutils.Vector((0, 1, 0))
    assert pick(head, *look) is None, "the eye is no skin"
    assert bpy.ops.wildcap.paint_mask() == {'FINISHED'}
    assert np.abs(shown(head) - rest).max() < 1e-6, "one paints on the head as it was solved"
    bpy.ops.wildcap.finish_mask()
    assert np.abs(shown(head) - rest).max() > 0.01 and not head.show_only_shape_key
    bpy.ops.wildcap.rest_face()
    shown(head)
    assert pick(head, *look) is not None


def test_the_iris_changes_its_colour_alone_and_an_undo_gives_it_back(head):
    """Blender's undo takes back no pixels within a picture; and the colour before can be chosen again."""
    name = head.name

    def colour() -> tuple[str, bool]:
        image = eye_image(bpy.data.objects[name])
        return image["wildcap_iris"], is_blue(rings(image)[0]) > 0.9

    white = rings(eye_image(head))[1]
    assert colour() == ("brown", False)
    bpy.ops.ed.undo_push(message="brown")
    images = len(bpy.data.images)
    bpy.ops.wildcap.iris(iris='blue')
    bpy.ops.ed.undo_push(message="blue")
    assert colour() == ("blue", True) and len(bpy.data.images) == images
    assert np.array_equal(rings(eye_image(head))[1], white)
    bpy.ops.ed.undo()
    assert colour() == ("brown", False)
    bpy.context.view_layer.objects.active = bpy.data.objects[name]
    bpy.ops.wildcap.iris(iris='blue')
    bpy.ops.wildcap.iris(iris='brown')
    assert colour() == ("brown", False) and eye_image(bpy.data.objects[name]).name == f"{name} Eye"


def test_a_head_that_was_filmed_with_open_eyes_looks_back(capture, addon, open_eyed):
    filmed, rows, solved = open_eyed
    bpy.ops.wildcap.bring_in_head()
    head, mesh = bpy.context.view_layer.objects.active, addon("acting.mesh")
    assert not mesh.has(head)
    bpy.ops.wildcap.assemble_material()
    keys = head.data.shape_keys
    assert mesh.has(head) and keys["eyesOpen"] == 1.0
    vertices = shown(head)
    assert np.abs(vertices[rows] - filmed[rows]).max() < 2e-6
    eye = vertices[left_eye(addon)] - EYE["centre"]
    away = np.linalg.norm(eye, axis=1) / EYE["radius"]
    assert np.abs(away - 1).max() < 0.07, "the cornea stands out by 6 %"
    front = eye[away > 1.01].mean(0)
    assert front / np.linalg.norm(front) == pytest.approx(EYE["gaze"], abs=0.01)
    assert is_blue(rings(eye_image(head))[0]) > 0.9, "the blue that was measured"

    keys.key_blocks["eyeBlinkLeft"].value = keys.key_blocks["eyeBlinkRight"].value = 1
    assert np.abs(shown(head)[:HEAD] - solved).max() < 2e-6, "closed lids are one unit away"
    bpy.ops.wildcap.rest_face()
    assert keys["eyesOpen"] == 1.0 and np.abs(shown(head)[rows] - filmed[rows]).max() < 2e-6
    bpy.ops.wildcap.iris(iris='brown')
    bpy.ops.wildcap.iris(iris='filmed')
    assert eye_image(head)["wildcap_iris"] == "0.110 0.200 0.390"
    bpy.ops.wildcap.assemble_material()
    assert head.data.shape_keys == keys, "once"
    (capture / "maps" / "irises.json").unlink()
    refuses("colour of these eyes", bpy.ops.wildcap.iris, iris='filmed')


def test_a_damaged_record_of_the_eyes_is_named_and_the_skin_is_there(capture, addon, open_eyed):
    (capture / "eyes.json").write_text("{}")
    bpy.ops.wildcap.bring_in_head()
    refuses(r"eyes\.json", bpy.ops.wildcap.assemble_material)
    head = bpy.context.view_layer.objects.active
    assert head.data.materials[0].get("wildcap_skin") and not addon("acting.mesh").has(head)
    (capture / "eyes.json").unlink()
    assert bpy.ops.wildcap.assemble_material() == {'FINISHED'}


def test_values_animation_and_materials_stay_when_another_shape_comes_in_and_over_a_reload(head, addon, tmp_path):
    keys, slots = head.data.shape_keys, list(head.data.materials)
    keys.key_blocks["jawOpen"].value = 0.4
    keys.key_blocks["browInnerUp"].keyframe_insert("value", frame=3)
    head.shape_key_add(name="Mine", from_mix=False).data[7].co.x += 0.01
    before = coordinates(keys.key_blocks["jawOpen"].data) - coordinates(keys.reference_key.data)
    solved, meshes = write_head(capture_of(head), 0.85), len(bpy.data.meshes)
    bpy.ops.wildcap.bring_in_head()
    assert head.data.shape_keys == keys and list(head.data.materials) == slots and len(bpy.data.meshes) == meshes
    basis = coordinates(keys.reference_key.data)
    assert np.abs(basis[:HEAD] - solved).max() < 1e-6
    assert coordinates(keys.key_blocks["Mine"].data)[7, 0] - basis[7, 0] == pytest.approx(0.01, abs=1e-5)
    after = coordinates(keys.key_blocks["jawOpen"].data) - basis
    assert 0.85 < np.linalg.norm(after) / np.linalg.norm(before) < 1, "a narrower head opens a little less"

    name = head.name
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "face.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "face.blend"))
    head = bpy.data.objects[name]
    keys = head.data.shape_keys
    assert addon("acting.mesh").has(head) and keys.key_blocks["jawOpen"].value == pytest.approx(0.4)
    assert keys.animation_data.action is not None and len(keys.animation_data.drivers) == 4
    assert eye_image(head).packed_file is not None and tuple(eye_image(head).size) == (512, 512)


def test_what_cannot_act_is_refused(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    refuses("no face units", bpy.ops.wildcap.rest_face)
    refuses("another mesh", bpy.ops.wildcap.add_face_units)
    bpy.context.view_layer.objects.active.shape_key_add(name="Basis")
    refuses("shape keys of its own", bpy.ops.wildcap.add_face_units)


def test_lids_keep_off_the_eyeballs_half_way(head, addon):
    """By half a millimetre; on a straight way from shut to open a lid would lie as deep within the cornea."""
    asset, keys = addon("acting.asset").load(), head.data.shape_keys
    eyes = [[int(i) for i in face if i >= 0] for face in asset.faces[asset.slots == 1]]
    lids = coordinates(keys.key_blocks["eyesOpenLeft"].data) - coordinates(keys.reference_key.data)
    lids = np.flatnonzero(np.linalg.norm(lids[: HEAD + COPIES], axis=1) > 3e-4)
    for eyes_open, blink in ((0, 0), (0.25, 0), (0.5, 0), (0.75, 0), (1, 0), (1, 0.5), (1, 0.75)):
        keys["eyesOpen"], keys.key_blocks["eyeBlinkLeft"].value = float(eyes_open), blink
        vertices = shown(head)
        ball, left = BVHTree.FromPolygons(vertices.tolist(), eyes), vertices[left_eye(addon)]
        centre, gaps = (left.max(0) + left.min(0)) / 2, []
        for arm in vertices[lids] - centre:
            far = np.linalg.norm(arm)
            if arm[1] < -0.4 * far:
                gaps.append(far - ball.ray_cast(centre.tolist(), (arm / far).tolist())[3])
        assert len(gaps) > 300 and min(gaps) > 2e-4, (eyes_open, blink)


def cut_neck(head) -> None:
    """Delete part of the mesh, as one does before joining it to a body."""
    bpy.ops.object.mode_set(mode='EDIT')
    mesh = bmesh.from_edit_mesh(head.data)
    bmesh.ops.delete(mesh, geom=[vertex for vertex in mesh.verts if vertex.co.z < NECK_M], context='VERTS')
    bmesh.update_edit_mesh(head.data)
    bpy.ops.object.mode_set(mode='OBJECT')


def test_a_head_whose_neck_was_cut_keeps_every_vertex_and_key_when_another_shape_comes(head):
    def state() -> dict[str, np.ndarray]:
        keys = {key.name: coordinates(key.data) for key in head.data.shape_keys.key_blocks}
        return {"": coordinates(head.data.vertices), **keys}

    head.shape_key_add(name="Mine", from_mix=False).data[7].co.x += 0.01
    cut_neck(head)
    before, mesh, meshes = state(), head.data, len(bpy.data.meshes)
    write_head(capture_of(head), 0.85)
    refuses("changed since", bpy.ops.wildcap.bring_in_head)
    after = state()
    assert head.data == mesh and len(bpy.data.meshes) == meshes
    assert before.keys() == after.keys() and len(before) > 50
    assert all(np.array_equal(before[name], after[name]) for name in before)


@pytest.mark.parametrize("lost", ["a unit", "its neck"])
def test_gaze_and_close_up_of_a_head_that_lost_something_stay_as_they_are(close_up, addon, lost):
    def state() -> tuple[dict, dict]:
        curves = close_up.data.shape_keys.animation_data.drivers
        return {curve.data_path: curve.driver.expression for curve in curves}, {
            thing: thing.data for thing in things(close_up).values()
        }

    bpy.ops.wildcap.gaze()
    if lost == "a unit":
        close_up.shape_key_remove(close_up.data.shape_keys.key_blocks["tongueOut"])
    else:
        cut_neck(close_up)
    before = state()
    assert bpy.ops.wildcap.assemble_material() == {'FINISHED'}
    assert not addon("relight.material").is_edited(close_up)
    assert state() == before and len(before[1]) == 12
    assert bpy.ops.wildcap.gaze() == bpy.ops.wildcap.close_up() == {'FINISHED'}, "they can be taken away"
    assert addon("acting.gaze").of(close_up) is None and not things(close_up)
    for button in (bpy.ops.wildcap.gaze, bpy.ops.wildcap.close_up):
        refuses("lost vertices or face units", button)


def test_what_fails_after_the_maps_are_in_does_not_pass_for_an_artists_edit(head, addon, monkeypatch):
    def fail(obj, capture):
        raise RuntimeError("no")

    monkeypatch.setattr(addon("head"), "COMPLETERS", [fail])
    head.data.materials[0].node_tree.nodes["WildCap Skin"].inputs["Roughness"].default_value = 0.31
    assert addon("relight.material").is_edited(head)
    with pytest.raises(RuntimeError, match="no"):
        bpy.ops.wildcap.assemble_material()
    assert not addon("relight.material").is_edited(head)
