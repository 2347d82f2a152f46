# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's part of a delivery: each file that Blender writes is read back by another reader, which finds mesh,
unit, UVs, maps and shape keys."""

import json
import os
import struct
import subprocess
import sys
from importlib import util
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
Vector = pytest.importorskip("mathutils").Vector
pytest.importorskip("OpenImageIO", reason="the worker's part needs its packages")

from tests.fixtures import delivered, mesh_reader  # noqa: E402
from tests.fixtures.delivered import KEYS  # noqa: E402
from tests.fixtures.refused import refuses  # noqa: E402

CLAMPED, REPEATED = 33071, 10497  # in glTF
HAIRS = np.array(
    [
        [[0, -0.1, 0.02], [0, -0.103, 0.021], [0, -0.106, 0.023]],
        [[0.01, -0.1, 0.02], [0.01, -0.104, 0.02], [0.011, -0.107, 0.02]],
    ],
    np.float32,
)


@pytest.fixture
def hairy(capture, addon):
    """Two hairs of 0.08 mm on the capture's head, and an eye that stands for a close-up."""
    head, colours = bpy.context.view_layer.objects.active, np.array([[0.02, 0.01, 0.01], [0.04, 0.03, 0.03]])
    eye = bpy.data.objects.new("Left Eye", bpy.data.meshes.new("Left Eye"))
    bpy.context.scene.collection.objects.link(eye)
    eye.parent, eye[addon("captures").CLOSE_UP_KEY] = head, "Left Eye"
    addon("groom.curves").grow_part(bpy.context, head, "brows", HAIRS, np.full((2, 3), 4e-5), colours)


def truth() -> np.ndarray:
    """Return the head's vertices at rest, [V, 3], metres, Z up."""
    mesh = bpy.data.objects["face"].data
    points = np.zeros(3 * len(mesh.vertices), np.float32)
    mesh.shape_keys.reference_key.data.foreach_get("co", points)
    return points.reshape(-1, 3)


def y_up(points) -> np.ndarray:
    points = np.atleast_2d(points)
    return np.stack([points[:, 0], points[:, 2], -points[:, 1]], 1)


def same_points(path: Path, expected: np.ndarray):
    """Hold the vertices that trimesh reads against others, whatever their order; return its mesh."""
    from scipy.spatial import cKDTree

    scene = pytest.importorskip("trimesh").load_scene(path, process=False)
    (mesh,) = scene.geometry.values()
    points, limit = np.asarray(mesh.vertices), 1e-5 * np.ptp(expected, 0).max()
    assert cKDTree(points).query(expected)[0].max() < limit and cKDTree(expected).query(points)[0].max() < limit
    return mesh


def glb(path: Path) -> tuple[dict, list[bytes]]:
    """Return a file's JSON and its pictures."""
    data = path.read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    document, binary = json.loads(data[20 : 20 + length]), data[28 + length :]
    views = [document["bufferViews"][image["bufferView"]] for image in document["images"]]
    return document, [binary[view["byteOffset"] :][: view["byteLength"]] for view in views]


def wrapped(document: dict) -> set[int]:
    """Return how the pictures of a glTF go on beyond their borders."""
    return {sampler.get(axis, REPEATED) for sampler in document["samplers"] for axis in ("wrapS", "wrapT")}


def by_another_reader(path: Path) -> dict:
    result = subprocess.run([sys.executable, mesh_reader.__file__, path], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)


def check_shapes(shapes: dict, expected, atol: float) -> None:
    """Hold offsets of all vertices against what `expected` makes of each key's move."""
    assert set(shapes) == set(KEYS)
    for name, move in KEYS.items():
        offsets = np.array(shapes[name])
        moving = np.linalg.norm(offsets, axis=1) > 1e-6
        assert moving.sum() == 40 and np.allclose(offsets[moving], expected(move), rtol=0, atol=atol)


def test_gltf_in_one_file(hairy, deliver):
    """With the head alone: hair goes along with no other format than USD, a close-up with none."""
    folder = deliver()
    read = same_points(folder / "face.glb", y_up(truth()))
    assert abs(read.visual.uv[:, 0].max() - 1) < 1e-6
    assert read.visual.material.baseColorTexture.size == (delivered.SIDE, delivered.SIDE)
    document, pictures = glb(folder / "face.glb")
    maps = {(folder / "textures" / f"face_{name}.png").read_bytes() for name in ("albedo", "normal")}
    assert maps == set(pictures), "the worker's bytes, not saved again"
    assert wrapped(document) == {CLAMPED}, "crown and neck, its upper and lower border, do not mix"
    (mesh,) = document["meshes"]
    assert mesh["extras"]["targetNames"] == list(KEYS) and mesh.get("weights", [0, 0]) == [0, 0]
    for target, move in zip(mesh["primitives"][0]["targets"], KEYS.values(), strict=True):
        accessor = document["accessors"][target["POSITION"]]
        low, high = np.array(accessor["min"]), np.array(accessor["max"])
        assert np.allclose(np.where(np.abs(low) > high, low, high), y_up(move)[0], atol=1e-6), "metres, Y up"


def test_gltf_with_files_refers_to_the_delivered_maps(deliver):
    folder = deliver(format="gltf", preset="unreal")
    uris = {image["uri"] for image in json.loads((folder / "face.gltf").read_text())["images"]}
    assert uris == {"textures/T_face_BaseColor.png", "textures/T_face_N.png"}
    assert all((folder / uri).stat().st_size for uri in uris)
    record = json.loads((folder / "provenance.json").read_text())
    assert record["delivery"]["normals"] == "opengl", "glTF has no other"


def test_a_metahuman_gets_open_eyes_and_no_shape_keys(capture, deliver):
    pytest.importorskip("ufbx")
    bpy.context.scene.wildcap.captures[0].deliver.preset = 'metahuman'
    refuses("lids are closed", bpy.ops.wildcap.deliver)
    head, moved = bpy.data.objects["face"], truth()
    for name, rows in (("eyesOpenLeft", slice(200, 210)), ("eyesOpenRight", slice(300, 310))):
        for point in head.shape_key_add(name=name, from_mix=False).data[rows]:
            point.co += Vector((0, 0.001, 0.004))
        moved[rows] += (0, 0.001, 0.004)
    read = by_another_reader(deliver(preset="metahuman") / "face.fbx")
    assert not read["shapes"] and np.allclose(read["points"], 100 * y_up(moved), atol=1e-4)
    assert len(head.data.shape_keys.key_blocks) == 5
    assert np.abs(truth() - moved).max() > 0.003, "the artist's head is as it was"


def test_fbx_in_centimetres_with_shape_keys(capture, deliver):
    pytest.importorskip("ufbx")
    folder = deliver(preset="unreal")
    read = by_another_reader(folder / "face.fbx")
    assert read["metres_per_unit"] == pytest.approx(0.01) and read["y_up"]
    assert np.allclose(read["points"], 100 * y_up(truth()), atol=1e-4), "in the order of the head's own vertices"
    assert np.allclose(read["scale"], 1) and np.allclose(read["turn"], [1, 0, 0, 0]) and read["has_uvs"]
    assert read["faces"] == len(bpy.data.objects["face"].data.polygons)
    check_shapes(read["shapes"], lambda move: 100 * y_up(move), 1e-4)
    assert {"textures/T_face_BaseColor.png", "textures/T_face_N.png"} <= set(read["textures"])
    assert all((folder / name).is_file() for name in read["textures"])
    assert str(capture.root).encode() not in (folder / "face.fbx").read_bytes(), (
        "where it was made is nobody's business"
    )


def test_usd_with_blend_shapes_colour_spaces_and_hair(hairy, deliver):
    if util.find_spec("pxr") is None or not bpy.app.build_options.usd:
        pytest.skip("no usd-core here, or a Blender without USD")
    folder = deliver(format="usd")
    read = by_another_reader(folder / "face.usdc")
    assert (read["metres_per_unit"], read["up"], read["subdivision"]) == (1, "Z", "none")
    assert np.allclose(read["to_world"], np.eye(4))
    assert np.allclose(read["points"], truth(), atol=1e-6) and {"st", "UVMap"} & set(read["primvars"])
    check_shapes(read["shapes"], lambda move: move, 1e-6)
    spaces = {"face_albedo.png": "sRGB", "face_normal.png": "raw", "face_roughness.png": "raw"}
    assert {Path(name).name: space for name, space in read["textures"].items()} == spaces
    assert all(not Path(name).is_absolute() and (folder / name).is_file() for name in read["textures"])
    ((name, (points, widths)),) = read["hairs"].items()
    assert "brows" in name and np.allclose(points, HAIRS.reshape(-1, 3), atol=1e-6)
    assert np.allclose(widths, 8e-5, rtol=1e-3)


def test_obj_for_character_creator(deliver):
    folder = deliver(preset="character_creator")
    same_points(folder / "face.obj", 100 * y_up(truth()))
    named = [line.split()[-1] for line in (folder / "face.mtl").read_text().splitlines() if line.startswith("map_")]
    assert {"textures/face_Diffuse.png", "textures/face_Normal.png"} <= set(named)
    assert all((folder / name).is_file() for name in named)


def test_the_artists_own_mesh_has_a_material_per_tile(capture, deliver):
    delivered.in_tiles(capture)
    folder = deliver(what="own_mesh", format="glb")
    document, _ = glb(folder / "face.glb")
    assert sorted(material["name"] for material in document["materials"]) == ["face_1001", "face_1002"]
    assert len(document["meshes"][0]["primitives"]) == 2
    assert wrapped(document) == {REPEATED}, "each tile's UVs begin anew at 0"
    albedos = {path.name for path in (folder / "textures").glob("*albedo*")}
    assert albedos == {"face_albedo.1001.png", "face_albedo.1002.png"}


def test_a_read_only_capture_is_delivered_to_another_folder_and_nothing_in_it_changes(capture, tmp_path, monkeypatch):
    def contents() -> dict[Path, bytes]:
        return {path: path.read_bytes() for path in capture.root.rglob("*") if path.is_file()}

    access = os.access
    monkeypatch.setattr(
        os, "access", lambda path, mode: access(path, mode) and (mode != os.W_OK or Path(path) != capture.root)
    )
    before = contents()
    refuses("read-only", bpy.ops.wildcap.deliver)
    bpy.context.scene.wildcap.captures[0].deliver.folder = str(tmp_path / "out")
    assert bpy.ops.wildcap.deliver() == {'FINISHED'}
    (folder,) = (tmp_path / "out").iterdir()
    assert list(folder.glob("*.glb")) and list((folder / "textures").iterdir())
    assert not any(path.is_symlink() for path in folder.rglob("*")) and contents() == before


def test_a_head_with_face_units_keeps_their_names_their_moves_and_its_eyes(capture, deliver, few_units):
    head = delivered.with_face_units(capture)
    keys = head.data.shape_keys
    keys["eyesOpen"] = 1.0  # posed: the neutral head is delivered all the same
    document, _ = glb(deliver() / "face.glb")
    mesh = document["meshes"][0]
    names = mesh["extras"]["targetNames"]
    units = [key.name for key in keys.key_blocks[1:] if not key.name.startswith("eyesHalf")]
    assert names == units and "jawOpen" in names and not any(mesh.get("weights", []))
    materials = [document["materials"][part["material"]] for part in mesh["primitives"]]
    assert [material["name"].split()[-2] for material in materials[1:]] == ["Eyes", "Mouth", "Teeth"]
    assert "baseColorTexture" in materials[1]["pbrMetallicRoughness"], "iris and white"
    basis, moved = (
        np.array([point.co for point in key.data]) for key in (keys.reference_key, keys.key_blocks["jawOpen"])
    )
    way = np.abs(moved - basis)
    targets = [
        document["accessors"][part["targets"][names.index("jawOpen")]["POSITION"]] for part in mesh["primitives"]
    ]
    stored = np.abs([(accessor["min"], accessor["max"]) for accessor in targets]).max((0, 1))
    assert np.allclose(stored, way.max(0)[[0, 2, 1]], atol=1e-6), "metres, Y up"
    eyes = np.array([i for polygon in head.data.polygons if polygon.material_index == 1 for i in polygon.vertices])
    assert way[eyes].max() == 0 and not np.any([targets[1]["min"], targets[1]["max"]]), "eyes stay when the jaw opens"


def test_pictures_of_the_artists_own_materials_take_no_maps_place(capture, deliver):
    """Two with one last word in their names, which is a map's, too; every picture is in the file as it was packed."""
    head, packed = bpy.data.objects["face"], set()
    for number, name in enumerate(("Ear Ring/Albedo", "Ring Albedo", "Stud Albedo")):
        material = bpy.data.materials.new(name)
        if material.node_tree is None:  # before Blender 5
            material.use_nodes = True
        node = material.node_tree.nodes.new('ShaderNodeTexImage')
        node.image = bpy.data.images.new(name, 4, 4)
        node.image.pixels.foreach_set((0.2, 0.3 * number, 0.5, 1.0) * 16)
        node.image.pack()
        packed.add(bytes(node.image.packed_file.data))
        shader = next(node for node in material.node_tree.nodes if node.type == 'BSDF_PRINCIPLED')
        material.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
        head.data.materials.append(material)
        head.data.polygons[number].material_index = len(head.data.materials) - 1
    maps = {name: (capture.maps / f"{name}.png").read_bytes() for name in ("diffuse_albedo", "normal")}
    folder = deliver()
    assert (folder / "textures" / "face_albedo.png").read_bytes() == maps["diffuse_albedo"]
    assert set(glb(folder / "face.glb")[1]) == {*packed, *maps.values()}
