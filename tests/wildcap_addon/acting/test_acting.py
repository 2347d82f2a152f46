# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Face units on a head in Blender: at rest it is the head as solved, and what the artist did to it stays."""

import json
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
Vector = pytest.importorskip("mathutils").Vector

TEMPLATE = Path(__file__).resolve().parents[3] / "core" / "assets" / "head.obj"
HEAD = 12225  # its vertices
COPIES = 101  # of the seams' lower side


def write_head(capture, narrower: float) -> np.ndarray:
    """The built-in head as a capture's, narrower than the template; its vertices [V, 3]."""
    lines, vertices = [], []
    for line in TEMPLATE.read_text().splitlines():
        if line.startswith("v "):
            x, y, z = (float(word) for word in line.split()[1:])
            vertices.append((round(x * narrower, 6), round(y + 0.2 * x * x, 6), round(z, 6)))
            line = "v {} {} {}".format(*vertices[-1])
        lines.append(line)
    (capture / "head.obj").write_text("\n".join(lines) + "\n")
    return np.array(vertices)


@pytest.fixture
def head(capture):
    """A head with its material and its face units, active."""
    write_head(capture, 0.95)
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    bpy.ops.wildcap.add_face_units()
    return bpy.context.view_layer.objects.active


@pytest.fixture
def open_eyed(capture, addon):
    """A capture that was filmed with open eyes, half as wide as MakeHuman opens them and looking to the left, and the
    carried head it was made from."""
    solved = write_head(capture, 0.95)
    asset, carrying = addon("acting.asset").load(), addon("acting.carrying")
    rest, units = carrying.carried(asset, solved)
    for side in ("Left", "Right"):
        rows, moves = units[f"eyesOpen{side}"]
        rest[rows] += 0.5 * moves
    sockets = np.flatnonzero((asset.kind == 0) & (asset.parts[:, 2] > -0.02))
    rows = np.concatenate([np.arange(HEAD), HEAD + np.flatnonzero(asset.seam > 0), HEAD + COPIES + sockets])
    (capture / "head_open.obj").write_text("".join("v {:.7f} {:.7f} {:.7f}\n".format(*place) for place in rest[rows]))
    eye = {
        "centre": [0.029, 0.003, -0.002],
        "radius": 0.0145,
        "gaze": [0.28, -0.96, 0.0],
        "openness": 0.5,
        "iris_radius": 0.0058,
        "views": 6,
    }
    (capture / "eyes.json").write_text(json.dumps({"left": eye, "right": {**eye, "centre": [-0.029, 0.003, -0.002]}}))
    (capture / "maps" / "irises.json").write_text(json.dumps({"left": [0.1, 0.2, 0.4], "right": [0.12, 0.2, 0.38]}))
    return rest, rows


def coordinates(data) -> np.ndarray:
    found = np.empty(3 * len(data), np.float32)
    data.foreach_get("co", found)
    return found.reshape(-1, 3)


def shown(head) -> np.ndarray:
    head.data.shape_keys.update_tag()
    return coordinates(head.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices)


def test_at_rest_it_is_the_head_that_was_solved_and_each_unit_of_the_eye_opens_the_lids(head, capture, addon):
    solved = write_head(capture, 0.95)
    rest = shown(head)
    assert np.abs(rest[:HEAD] - solved).max() < 1e-6
    corners = np.empty(len(head.data.loops), np.int32)
    head.data.loops.foreach_get("vertex_index", corners)
    skin = corners[: 3 * 24356]
    assert skin.max() == HEAD + COPIES - 1  # the seams' lower side, and nothing from inside, became part of the skin
    assert np.abs(rest[skin].reshape(-1, 3, 3) - solved[_triangles()]).max() < 1e-6  # the cut moved no triangle
    assert head.data.materials[0].get("wildcap_skin")
    assert [m.name.split()[-1] for m in head.data.materials[1:]] == ["Eyes", "Mouth", "Teeth"]
    _uvs_apart(head)
    rough = np.empty(len(head.data.vertices), np.float32)
    head.data.attributes["wildcap_roughness"].data.foreach_get("value", rough)
    assert (
        np.ptp(rough[:HEAD]) > 0.05 and np.ptp(rough[HEAD : HEAD + COPIES]) > 0.01 and not rough[HEAD + COPIES :].any()
    )

    keys, lids = head.data.shape_keys, np.unique(skin[skin >= HEAD])
    blocks = keys.key_blocks
    blocks["eyeBlinkLeft"].value = 1
    assert np.abs(shown(head) - rest)[lids].max() < 1e-6  # shut they stay shut
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
    assert np.abs(shown(head) - rest)[:HEAD, 2].max() > 0.005  # to look somewhere is to open the eye
    with pytest.raises(RuntimeError, match="has its face units already"):
        bpy.ops.wildcap.add_face_units()

    keys["eyesOpen"] = 1.0
    blocks["jawOpen"].value = 1
    pick = addon("solve.eyedropper").uv_on
    eye = head.matrix_world @ Vector(rest[_kind(addon) == 1].mean(0))
    assert pick(head, eye + Vector((0, -1, 0)), Vector((0, 1, 0))) is None  # the eye is no skin
    assert bpy.ops.wildcap.paint_mask() == {'FINISHED'}
    assert np.abs(shown(head) - rest).max() < 1e-6  # one paints on the head as it was solved
    bpy.ops.wildcap.finish_mask()
    assert np.abs(shown(head) - rest).max() > 0.01 and not head.show_only_shape_key
    bpy.ops.wildcap.rest_face()
    assert pick(head, eye + Vector((0, -1, 0)), Vector((0, 1, 0))) is not None

    eye = head.data.materials[1].node_tree.nodes["WildCap Eye"]
    before = np.array(eye.image.pixels[:]).reshape(512, 512, 4)
    bpy.ops.wildcap.iris(iris='blue')
    after = np.array(eye.image.pixels[:]).reshape(512, 512, 4)
    radius = np.hypot(*(np.mgrid[:512, :512] + 0.5 - 256)) / 512
    iris = (radius > 0.1) & (radius < 0.13)
    assert (before[iris, 0] > before[iris, 2]).mean() > 0.9 and (after[iris, 2] > after[iris, 0]).mean() > 0.9
    assert np.abs(after - before)[radius > 0.2].max() == 0


def test_a_head_that_was_filmed_with_open_eyes_looks_back(capture, addon, open_eyed):
    filmed, rows = open_eyed
    solved = write_head(capture, 0.95)
    bpy.ops.wildcap.bring_in_head()
    head = bpy.context.view_layer.objects.active
    assert not addon("acting.mesh").has(head)
    bpy.ops.wildcap.assemble_material()
    keys = head.data.shape_keys
    assert addon("acting.mesh").has(head) and keys["eyesOpen"] == 1.0
    seen = shown(head)
    assert np.abs(seen[rows] - filmed[rows]).max() < 2e-6
    eye = seen[_kind(addon) == 1]
    # the cornea stands out by 6 %
    assert np.abs(np.linalg.norm(eye - [0.029, 0.003, -0.002], axis=1) - 0.0145).max() < 0.07 * 0.0145
    cornea = np.linalg.norm(eye - [0.029, 0.003, -0.002], axis=1) > 1.01 * 0.0145
    front = eye[cornea].mean(0) - [0.029, 0.003, -0.002]
    assert front / np.linalg.norm(front) == pytest.approx([0.28, -0.96, 0.0], abs=0.01)
    image = np.array(head.data.materials[1].node_tree.nodes["WildCap Eye"].image.pixels[:]).reshape(512, 512, 4)
    radius = np.hypot(*(np.mgrid[:512, :512] + 0.5 - 256)) / 512
    assert (
        image[(radius > 0.1) & (radius < 0.13)][:, 2] > image[(radius > 0.1) & (radius < 0.13)][:, 0]
    ).mean() > 0.9, "the blue that was measured"

    keys.key_blocks["eyeBlinkLeft"].value = keys.key_blocks["eyeBlinkRight"].value = 1
    assert np.abs(shown(head)[:HEAD] - solved).max() < 2e-6  # closed lids are one unit away
    bpy.ops.wildcap.rest_face()
    assert keys["eyesOpen"] == 1.0 and np.abs(shown(head)[rows] - filmed[rows]).max() < 2e-6
    bpy.ops.wildcap.iris(iris='brown')
    bpy.ops.wildcap.iris(iris='filmed')
    assert head.data.materials[1].node_tree.nodes["WildCap Eye"].image["wildcap_iris"] == "0.110 0.200 0.390"
    bpy.ops.wildcap.assemble_material()
    assert head.data.shape_keys == keys  # once
    (capture / "maps" / "irises.json").unlink()
    with pytest.raises(RuntimeError, match="do not tell the colour"):
        bpy.ops.wildcap.iris(iris='filmed')


def test_a_damaged_record_of_the_eyes_is_named_and_the_skin_is_there(capture, addon, open_eyed):
    (capture / "eyes.json").write_text("{}")
    bpy.ops.wildcap.bring_in_head()
    with pytest.raises(RuntimeError, match="eyes.json cannot be read"):
        bpy.ops.wildcap.assemble_material()
    head = bpy.context.view_layer.objects.active
    assert head.data.materials[0].get("wildcap_skin") and not addon("acting.mesh").has(head)
    (capture / "eyes.json").unlink()
    assert bpy.ops.wildcap.assemble_material() == {'FINISHED'}


def test_values_animation_and_materials_stay_when_another_shape_comes_in_and_over_a_reload(
    head, capture, addon, tmp_path
):
    keys, slots = head.data.shape_keys, list(head.data.materials)
    keys.key_blocks["jawOpen"].value = 0.4
    keys.key_blocks["browInnerUp"].keyframe_insert("value", frame=3)
    mine = head.shape_key_add(name="Mine", from_mix=False)
    mine.data[7].co.x += 0.01
    before = coordinates(keys.key_blocks["jawOpen"].data) - coordinates(keys.reference_key.data)
    solved = write_head(capture, 0.85)
    meshes = len(bpy.data.meshes)
    bpy.ops.wildcap.bring_in_head()
    assert head.data.shape_keys == keys and list(head.data.materials) == slots and len(bpy.data.meshes) == meshes
    basis = coordinates(keys.reference_key.data)
    assert np.abs(basis[:HEAD] - solved).max() < 1e-6
    assert coordinates(keys.key_blocks["Mine"].data)[7, 0] - basis[7, 0] == pytest.approx(0.01, abs=1e-5)
    after = coordinates(keys.key_blocks["jawOpen"].data) - basis
    assert 0.85 < np.linalg.norm(after) / np.linalg.norm(before) < 1  # a narrower head opens a little less

    name = head.name
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "face.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "face.blend"))
    head = bpy.data.objects[name]
    keys = head.data.shape_keys
    assert addon("acting.mesh").has(head) and keys.key_blocks["jawOpen"].value == pytest.approx(0.4)
    assert keys.animation_data.action is not None and len(keys.animation_data.drivers) == 4
    eye = head.data.materials[1].node_tree.nodes["WildCap Eye"].image
    assert eye.packed_file is not None and tuple(eye.size) == (512, 512)


def test_what_cannot_act_is_told_why(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    with pytest.raises(RuntimeError, match="no face units yet"):
        bpy.ops.wildcap.rest_face()
    with pytest.raises(RuntimeError, match="this is another mesh"):
        bpy.ops.wildcap.add_face_units()
    bpy.context.view_layer.objects.active.shape_key_add(name="Basis")
    with pytest.raises(RuntimeError, match="shape keys of its own"):
        bpy.ops.wildcap.add_face_units()


def _triangles() -> np.ndarray:
    return np.array(
        [
            [int(corner.split("/")[0]) - 1 for corner in line.split()[1:]]
            for line in TEMPLATE.read_text().splitlines()
            if line.startswith("f ")
        ]
    )


def _kind(addon) -> np.ndarray:
    """What each vertex moves with, -1 for the head's own and the copies: 1 is the left eye."""
    kind = addon("acting.asset").load().kind
    return np.concatenate([np.full(HEAD + COPIES, -1), kind])


def _uvs_apart(head) -> None:
    """Eyes, mouth and teeth have their UVs in tiles of their own, where no map of the skin is painted."""
    uv = np.empty(2 * len(head.data.loops), np.float32)
    head.data.uv_layers["UVMap"].data.foreach_get("uv", uv)
    tile = np.repeat([p.material_index for p in head.data.polygons], [p.loop_total for p in head.data.polygons])
    u = uv.reshape(-1, 2)[:, 0]
    assert (u >= tile - 1e-6).all() and (u <= tile + 1 + 1e-6).all() and set(tile) == {0, 1, 2, 3}
