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

from core.capture.messages import Done  # noqa: E402
from tests.fixtures import delivered  # noqa: E402
from tests.fixtures.delivered import SIDE  # noqa: E402

KEYS = {"jawOpen": (0.0, -0.01, -0.02), "eyeBlinkLeft": (0.005, 0.0, 0.0)}
MOVED = slice(100, 140)
CLAMPED, REPEATED = 33071, 10497  # in glTF


@pytest.fixture
def capture(addon, tmp_path, monkeypatch):
    """A solved capture whose head is in the scene, turned and with two shape keys that are in use; jobs run here at
    once."""
    capture = delivered.make(tmp_path / "face.wildcap")
    bpy.ops.wildcap.open_capture(directory=str(capture.root))
    bpy.ops.wildcap.bring_in_head()
    head = bpy.context.view_layer.objects.active
    head.location, head.rotation_euler = (1, 2, 3), (0.1, 0.2, 0.3)
    head.shape_key_add(name="Basis")
    for name, move in KEYS.items():
        key = head.shape_key_add(name=name, from_mix=False)
        key.value = 0.7
        for i in range(len(key.data))[MOVED]:
            key.data[i].co += Vector(move)

    def start(item, tool, goal, *, then, at, ended, **shared):
        last = delivered.deliver(at, **shared["deliver"])
        ended()
        assert isinstance(last, Done), last
        then()

    monkeypatch.setattr(addon("jobs"), "start_tool", start)
    return capture


def deliver(capture, **settings) -> Path:
    """Clicks Deliver with these settings; the folder it made."""
    group = bpy.context.scene.wildcap.captures[0].deliver
    for name, value in settings.items():
        setattr(group, name, value)
    before = {
        kind: len(getattr(bpy.data, kind))
        for kind in ("objects", "meshes", "materials", "images", "scenes", "shape_keys")
    }
    assert bpy.ops.wildcap.deliver() == {'FINISHED'}
    after = {kind: len(getattr(bpy.data, kind)) for kind in before}
    assert after == before and bpy.context.window.scene.name != "WildCap Delivery", "nothing of it stays in the .blend"
    made = [path for path in capture.exports.iterdir() if not path.name.startswith(".")]
    assert len(made) == 1 and not list(capture.exports.glob(".*"))
    told = json.loads((made[0] / "provenance.json").read_text())
    assert (
        told["versions"]["Blender"] == bpy.app.version_string
        and f"textures/{sorted((made[0] / 'textures').iterdir())[0].name}" in told["files"]
    )
    assert str(capture.root) not in (made[0] / "provenance.json").read_text()
    assert not (made[0] / "packing.json").exists()
    return made[0]


def truth() -> np.ndarray:
    """The head's vertices at rest, [V, 3], metres, Z up."""
    mesh = bpy.data.objects["face"].data
    out = np.zeros(3 * len(mesh.vertices), np.float32)
    mesh.shape_keys.reference_key.data.foreach_get("co", out)
    return out.reshape(-1, 3)


def y_up(points: np.ndarray) -> np.ndarray:
    return np.stack([points[:, 0], points[:, 2], -points[:, 1]], 1)


def same_points(a: np.ndarray, b: np.ndarray, size: float) -> None:
    """The same set of points, whatever their order."""
    from scipy.spatial import cKDTree

    assert cKDTree(a).query(b)[0].max() < 1e-5 * size and cKDTree(b).query(a)[0].max() < 1e-5 * size


def glb(path: Path) -> tuple[dict, bytes]:
    data = path.read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def wrapped(document: dict) -> set[int]:
    """How the pictures of a glTF go on beyond their borders."""
    return {sampler.get(axis, REPEATED) for sampler in document["samplers"] for axis in ("wrapS", "wrapT")}


def by_another_reader(path: Path) -> dict:
    result = subprocess.run(
        [sys.executable, Path(__file__).parents[2] / "fixtures" / "mesh_reader.py", path],
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)


def test_gltf_in_one_file(capture):
    trimesh = pytest.importorskip("trimesh")
    folder = deliver(capture)
    read = next(iter(trimesh.load_scene(folder / "face.glb", process=False).geometry.values()))
    same_points(np.asarray(read.vertices), y_up(truth()), 0.2)
    assert abs(read.visual.uv[:, 0].max() - 1) < 1e-6 and read.visual.material.baseColorTexture.size == (SIDE, SIDE)
    document, binary = glb(folder / "face.glb")
    stored = []
    for image in document["images"]:
        view = document["bufferViews"][image["bufferView"]]
        stored.append(binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
    assert {(folder / "textures" / f"face_{name}.png").read_bytes() for name in ("albedo", "normal")} == set(stored), (
        "the worker's bytes, not saved again"
    )
    assert wrapped(document) == {CLAMPED}, "crown and neck, its upper and lower border, do not mix"
    mesh = document["meshes"][0]
    assert mesh["extras"]["targetNames"] == list(KEYS) and mesh.get("weights", [0, 0]) == [0, 0]
    for i, move in enumerate(KEYS.values()):
        accessor = document["accessors"][mesh["primitives"][0]["targets"][i]["POSITION"]]
        low, high = np.array(accessor["min"]), np.array(accessor["max"])
        farthest = np.where(np.abs(low) > high, low, high)
        assert np.allclose(farthest, y_up(np.array([move]))[0], atol=1e-6), "metres, Y up"


def test_gltf_with_files_refers_to_the_delivered_maps(capture):
    folder = deliver(capture, format="gltf", preset="unreal")
    document = json.loads((folder / "face.gltf").read_text())
    uris = {image["uri"] for image in document["images"]}
    assert uris == {"textures/T_face_BaseColor.png", "textures/T_face_N.png"}
    assert all((folder / uri).is_file() for uri in uris)
    normal = (folder / "textures" / "T_face_N.png").stat().st_size
    assert normal and json.loads((folder / "provenance.json").read_text())["delivery"]["normals"] == "opengl", (
        "glTF has no other"
    )


def test_a_metahuman_gets_open_eyes_and_no_shape_keys(capture):
    pytest.importorskip("ufbx")
    bpy.context.scene.wildcap.captures[0].deliver.preset = 'metahuman'
    with pytest.raises(
        RuntimeError, match="MetaHuman from Mesh wants a head with open eyes, and this one's lids are closed"
    ):
        bpy.ops.wildcap.deliver()
    head, moved = bpy.data.objects["face"], truth()
    for name, rows in (("eyesOpenLeft", slice(200, 210)), ("eyesOpenRight", slice(300, 310))):
        for point in head.shape_key_add(name=name, from_mix=False).data[rows]:
            point.co += Vector((0, 0.001, 0.004))
        moved[rows] += (0, 0.001, 0.004)
    read = by_another_reader(deliver(capture, preset="metahuman") / "face.fbx")
    assert not read["shapes"] and np.allclose(read["points"], 100 * y_up(moved), atol=1e-4)
    assert len(head.data.shape_keys.key_blocks) == 5
    assert np.abs(truth() - moved).max() > 0.003, "the artist's head is as it was"


def test_fbx_in_centimetres_with_shape_keys(capture):
    pytest.importorskip("ufbx")
    folder = deliver(capture, preset="unreal")
    read = by_another_reader(folder / "face.fbx")
    assert read["metres_per_unit"] == pytest.approx(0.01) and read["y_up"]
    assert np.allclose(read["points"], 100 * y_up(truth()), atol=1e-4), "in the order of the head's own vertices"
    assert np.allclose(read["scale"], 1) and np.allclose(read["turn"], [1, 0, 0, 0]) and read["has_uvs"]
    assert read["faces"] == len(bpy.data.objects["face"].data.polygons) and set(read["shapes"]) == set(KEYS)
    for name, move in KEYS.items():
        offsets = np.array(read["shapes"][name])
        moving = np.linalg.norm(offsets, axis=1) > 1e-6
        assert moving.sum() == 40 and np.allclose(offsets[moving], 100 * y_up(np.array([move])), atol=1e-4)
    assert {"textures/T_face_BaseColor.png", "textures/T_face_N.png"} <= set(read["textures"])
    assert all((folder / name).is_file() for name in read["textures"])
    stored = (folder / "face.fbx").read_bytes()
    assert str(capture.root).encode() not in stored, "where it was made is nobody's business"


def test_usd_with_blend_shapes_and_colour_spaces(capture):
    if util.find_spec("pxr") is None or not bpy.app.build_options.usd:
        pytest.skip("no usd-core here, or a Blender without USD")
    folder = deliver(capture, format="usd")
    read = by_another_reader(folder / "face.usdc")
    assert (read["metres_per_unit"], read["up"], read["subdivision"]) == (1, "Z", "none")
    assert np.allclose(read["to_world"], np.eye(4))
    assert np.allclose(read["points"], truth(), atol=1e-6) and {"st", "UVMap"} & set(read["primvars"])
    assert set(read["shapes"]) == set(KEYS)
    for name, move in KEYS.items():
        offsets = np.array(read["shapes"][name])
        assert np.allclose(offsets[np.linalg.norm(offsets, axis=1) > 1e-6], move, atol=1e-6)
    assert {Path(name).name: space for name, space in read["textures"].items()} == {
        "face_albedo.png": "sRGB",
        "face_normal.png": "raw",
        "face_roughness.png": "raw",
    }
    assert all(not Path(name).is_absolute() and (folder / name).is_file() for name in read["textures"])


def test_fbx_for_arnold_refers_to_linear_exr_numbered_by_tile(capture):
    pytest.importorskip("ufbx")
    folder = deliver(capture, preset="arnold")
    read = by_another_reader(folder / "face.fbx")
    linked = {"base_color", "normal_camera", "specular", "specular_roughness"}
    assert set(read["textures"]) == {f"textures/face_{name}.1001.exr" for name in linked}
    assert all((folder / name).is_file() for name in read["textures"])


def test_obj_for_character_creator(capture):
    trimesh = pytest.importorskip("trimesh")
    folder = deliver(capture, preset="character_creator")
    read = next(iter(trimesh.load_scene(folder / "face.obj", process=False).geometry.values()))
    same_points(np.asarray(read.vertices), 100 * y_up(truth()), 20)
    named = [line.split()[-1] for line in (folder / "face.mtl").read_text().splitlines() if line.startswith("map_")]
    assert {"textures/face_Diffuse.png", "textures/face_Normal.png"} <= set(named)
    assert all((folder / name).is_file() for name in named)


def test_the_artists_own_mesh_has_a_material_per_tile(capture):
    delivered.in_tiles(capture)
    folder = deliver(capture, what="own_mesh", format="glb")
    document, _ = glb(folder / "face.glb")
    assert (
        sorted(material["name"] for material in document["materials"]) == ["face_1001", "face_1002"]
        and len(document["meshes"][0]["primitives"]) == 2
    )
    assert wrapped(document) == {REPEATED}, "each tile's UVs begin anew at 0"
    albedos = {path.name for path in (folder / "textures").glob("*albedo*")}
    assert albedos == {"face_albedo.1001.png", "face_albedo.1002.png"}


def test_a_read_only_capture_is_delivered_to_another_folder_and_nothing_in_it_changes(
    addon, capture, tmp_path, monkeypatch
):
    access = os.access

    def read_only(path, mode):
        return access(path, mode) and not (mode == os.W_OK and Path(path) == capture.root)

    monkeypatch.setattr(os, "access", read_only)
    before = {path: path.read_bytes() for path in capture.root.rglob("*") if path.is_file()}
    with pytest.raises(RuntimeError, match="is read-only"):
        bpy.ops.wildcap.deliver()
    bpy.context.scene.wildcap.captures[0].deliver.folder = str(tmp_path / "out")
    assert bpy.ops.wildcap.deliver() == {'FINISHED'}
    (folder,) = (tmp_path / "out").iterdir()
    assert (
        list(folder.glob("*.glb"))
        and list((folder / "textures").iterdir())
        and not any(path.is_symlink() for path in folder.rglob("*"))
    )
    assert {path: path.read_bytes() for path in capture.root.rglob("*") if path.is_file()} == before


def test_a_head_with_face_units_keeps_their_names_their_moves_and_its_eyes(capture):
    head = delivered.with_face_units(capture)
    keys = head.data.shape_keys
    keys["eyesOpen"] = 1.0  # posed: the neutral head is delivered all the same
    document, binary = glb(deliver(capture) / "face.glb")
    mesh = document["meshes"][0]
    names = mesh["extras"]["targetNames"]
    units = [key.name for key in keys.key_blocks[1:] if not key.name.startswith("eyesHalf")]
    assert names == units and len(names) == 54 and not any(mesh.get("weights", []))
    assert [document["materials"][part["material"]]["name"].split()[-2:][0] for part in mesh["primitives"]][1:] == [
        "Eyes",
        "Mouth",
        "Teeth",
    ]
    eyes = document["materials"][mesh["primitives"][1]["material"]]["pbrMetallicRoughness"]
    assert "baseColorTexture" in eyes, "iris and white"
    basis, moved = (
        np.array([point.co for point in key.data]) for key in (keys.reference_key, keys.key_blocks["jawOpen"])
    )
    span = np.abs(moved - basis).max(0)
    found = [document["accessors"][part["targets"][names.index("jawOpen")]["POSITION"]] for part in mesh["primitives"]]
    stored = np.abs([(accessor["min"], accessor["max"]) for accessor in found]).max((0, 1))
    assert np.allclose(stored, span[[0, 2, 1]], atol=1e-6), "metres, Y up"
    eyes = np.array([i for polygon in head.data.polygons if polygon.material_index == 1 for i in polygon.vertices])
    assert np.abs(moved - basis)[eyes].max() == 0, "eyes stay when the jaw opens"
    assert not np.any([found[1]["min"], found[1]["max"]])
