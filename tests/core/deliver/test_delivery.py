# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker's part of a delivery: known tiny maps come out packed, flipped and named as the table says."""

import errno
import hashlib
import json
import os
import shutil
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
import trimesh
from scipy.spatial import cKDTree

from core import deliver
from core.__main__ import main
from core.capture import delivery_plan, skin_regions, stages
from core.capture.capture import Capture
from core.capture.messages import Cancelled, Done, Failed
from core.face import template
from core.geometry import meshes
from core.imaging import images
from core.settings.settings import DeliverSettings, Settings
from tests.conftest import ROOT
from tests.fixtures import delivered
from tests.fixtures.delivered import NORMALS, OBJ, SIDE, folder
from tests.fixtures.recorded import record


@pytest.fixture
def capture(tmp_path) -> Capture:
    return delivered.make(tmp_path / "Zoë et moi.wildcap")


@pytest.fixture(scope="module")
def shared(tmp_path_factory) -> Capture:
    """A capture with a displacement map and five deliveries, for tests that only look at them."""
    capture = delivered.make(tmp_path_factory.mktemp("shared") / "Zoë et moi.wildcap")
    capture.delivery.mkdir()
    images.write_data(capture.delivery / "displacement.exr", np.full((SIDE, SIDE), -0.002))
    delivered.deliver(capture, preset="unreal", pictures="png16", roughness=40, **OBJ)
    for preset in ("blender", "unity_hdrp", "unity_urp", "arnold"):
        delivered.deliver(capture, preset=preset, roughness=40, **OBJ)
    return capture


def textures(capture: Capture, preset: str = "blender") -> Path:
    return folder(capture, preset=preset) / "textures"


def stored(path: Path) -> np.ndarray:
    """The integers in a 16 bit picture."""
    return np.round(images.read_data(path) * 65535).astype(int)


def four_channels(path: Path) -> np.ndarray:
    """R, G, B, A as stored, by a reader that does not multiply by alpha."""
    as_stored = oiio.ImageSpec()
    as_stored.attribute("oiio:UnassociatedAlpha", 1)
    return oiio.ImageInput.open(str(path), as_stored).read_image("uint8") / 255


def test_directx_flips_the_green_of_every_texel_and_nothing_else(shared):
    before = stored(shared.maps / "normal.png")
    after = stored(textures(shared, "unreal") / "T_Zoe_et_moi_N.png")
    assert (before[..., 1] == np.round(NORMALS[..., 1] * 65535)).all() and len(np.unique(before[..., 1])) == SIDE
    assert (after[..., 1] == 65535 - before[..., 1]).all() and (after[..., [0, 2]] == before[..., [0, 2]]).all()


def test_what_needs_no_change_is_the_solvers_file_byte_for_byte(shared):
    made = textures(shared)
    assert (made / "Zoe_et_moi_albedo.png").read_bytes() == (shared.maps / "diffuse_albedo.png").read_bytes()
    assert (made / "Zoe_et_moi_normal.png").read_bytes() == (shared.maps / "normal.png").read_bytes()
    assert not list(made.glob("*brows*")), "it has no hair masks"


def test_channels_are_packed_as_unity_and_unreal_read_them(shared):
    """The specular map is 0.2 on one half and 0.4 on the other, its mean over the face 0.3: skin of an IOR of 1.4
    reflects 2.8 % there."""
    maps = deliver.maps.Sources({"albedo": shared.maps / "diffuse_albedo.png"}, SIDE, 0.4, 0.3, regions=True)
    rough, reflectance = maps.channel("roughness"), [0.0278 * 2 / 3, 0.0278 * 4 / 3]
    mask = four_channels(textures(shared, "unity_hdrp") / "Zoe_et_moi_MaskMap.png")
    assert np.allclose(mask[..., :3], [0, 1, 1], atol=0.003) and np.allclose(mask[..., 3], 1 - rough, atol=0.003)
    urp = four_channels(textures(shared, "unity_urp") / "Zoe_et_moi_SpecGlossMap.png")
    assert np.allclose(images.srgb_to_linear(urp[:, [0, -1], 0]), reflectance, atol=5e-4)
    assert np.allclose(urp[..., 3], 1 - rough, atol=0.003)
    packed = images.read_data(textures(shared, "unreal") / "T_Zoe_et_moi_ORM.png")
    assert np.allclose(packed[..., [0, 2]], [1, 0], atol=0.003) and np.allclose(packed[..., 1], rough, atol=0.003)
    specular = images.read_data(textures(shared, "unreal") / "T_Zoe_et_moi_Specular.png")
    assert np.allclose(specular[:, [0, -1], 0] * 0.08, reflectance, atol=3e-4)
    weight = images.read_data(textures(shared, "arnold") / "Zoe_et_moi_specular.1001.exr")
    assert np.allclose(weight[:, [0, -1], 0], [2 / 3, 4 / 3], atol=1e-3), "EXR keeps what is above 1"


@pytest.mark.parametrize(
    ("pictures", "colour", "depth", "tag"),
    [("png8", "srgb", 8, b"sRGB"), ("png16", "srgb", 16, b"sRGB"), ("png16", "linear", 16, b"gAMA")],
)
def test_pngs_have_the_depth_and_say_their_colour_space(shared, tmp_path, pictures, colour, depth, tag):
    plan = delivery_plan.plan(shared, DeliverSettings(format="obj", pictures=pictures, colour=colour))
    paths = {"albedo": "diffuse_albedo.png", "normal": "normal.png", "specular": "specular_albedo.png"}
    maps = deliver.maps.Sources({name: shared.maps / path for name, path in paths.items()}, SIDE, 0.4, 0.3)
    for picture in plan.preset.maps:
        deliver.maps.write(picture, maps, tmp_path / f"{picture.name.format(name='a')}.png", plan)
    bits, kind, chunks = delivered.png(tmp_path / "a_albedo.png")
    assert (bits, kind) == (depth, 2) and tag in chunks and (b"sRGB" in chunks) == (colour == "srgb")
    assert b"sRGB" not in delivered.png(tmp_path / "a_specular_level.png")[2]
    assert delivered.png(tmp_path / "a_normal.png")[0] == depth
    albedo = images.read_data(tmp_path / "a_albedo.png")
    linear = albedo if colour == "linear" else images.srgb_to_linear(albedo)
    truth = images.read_linear(shared.maps / "diffuse_albedo.exr")
    assert np.allclose(linear, truth, atol=4e-3 if depth == 8 else 3e-4)


def test_exr_is_linear_half_float_and_numbered_by_tile(shared):
    made = textures(shared, "arnold")
    names = {"base_color", "normal_camera", "specular", "specular_roughness", "displacement"}
    assert {path.name for path in made.iterdir()} == {f"Zoe_et_moi_{name}.1001.exr" for name in names}
    spec = oiio.ImageInput.open(str(made / "Zoe_et_moi_base_color.1001.exr")).spec()
    linear = ("lin_srgb", "Linear", "lin_rec709", "lin_rec709_scene")
    assert str(spec.format) == "half" and spec.getattribute("oiio:ColorSpace") in linear
    albedo = images.read_data(made / "Zoe_et_moi_base_color.1001.exr")
    assert np.allclose(albedo, images.read_data(shared.maps / "diffuse_albedo.exr"), atol=3e-4)
    displacement = images.read_data(made / "Zoe_et_moi_displacement.1001.exr")
    assert np.allclose(displacement, -0.2, atol=1e-4), "centimetres, as the mesh"


def test_roughness_follows_the_regions_of_the_built_in_head_alone(shared):
    paths = {"albedo": shared.maps / "diffuse_albedo.png"}
    plain, head = (deliver.maps.Sources(paths, 256, 0.5, 0.3, regions=regions) for regions in (False, True))
    plain.size = head.size = 256
    lips, scalp = (template.mask(name, 256) > 0.99 for name in ("lips", "scalp"))
    assert np.allclose(plain.channel("roughness"), 0.5) and lips.any() and scalp.any()
    assert np.allclose(head.channel("roughness")[lips], 0.5 * (1 + skin_regions.ROUGHNESS["lips"]), atol=2e-3)
    assert np.allclose(head.channel("smoothness")[scalp], 1 - 0.5 * (1 + skin_regions.ROUGHNESS["scalp"]), atol=2e-3)


def test_maps_are_made_smaller_but_never_larger(shared, tmp_path):
    plan = delivery_plan.plan(shared, DeliverSettings(format="obj"))
    paths = {"albedo": shared.maps / "diffuse_albedo.png", "normal": shared.maps / "normal.png"}
    assert deliver.maps.Sources(paths, 4096, 0.4, 0.3).size == SIDE
    small = deliver.maps.Sources(paths, 4, 0.4, 0.3)
    for picture in plan.preset.maps[:2]:
        deliver.maps.write(picture, small, tmp_path / f"{picture.kind}.png", plan)
    assert images.size(tmp_path / "colour.png") == (4, 4)
    normals = images.read_data(tmp_path / "normal.png") * 2 - 1
    assert np.allclose(np.linalg.norm(normals, axis=2), 1, atol=1e-4)
    light = images.read_linear(shared.maps / "diffuse_albedo.exr").reshape(4, 4, 4, 4, 3).mean((1, 3))
    assert np.allclose(images.read_linear(tmp_path / "colour.png"), light, atol=3e-4), "averaged as light"


def test_the_enlarged_maps_are_delivered_where_they_were_made_of_the_solved_ones_whatever_times_files_have(capture):
    shutil.copytree(capture.maps, capture.maps_4k)
    images.write_srgb(capture.maps_4k / "diffuse_albedo.png", np.full((SIDE, SIDE, 3), 0.5), 16)
    record(capture, stages.by_name("upscale"), Settings())
    for path in capture.maps.iterdir():  # a copy of a folder may be of any times
        os.utime(path, (3e9, 3e9))
    delivered.deliver(capture, **OBJ)
    made = textures(capture) / "Zoe_et_moi_albedo.png"
    assert made.read_bytes() == (capture.maps_4k / "diffuse_albedo.png").read_bytes()
    images.write_srgb(capture.maps / "diffuse_albedo.png", np.full((SIDE, SIDE, 3), 0.3), 16)
    assert isinstance(delivered.deliver(capture, **OBJ), Failed), "another solve, which nobody enlarged"


def test_hair_masks_and_clean_skin_go_along_where_there_are_some(capture):
    assert "no albedo without hair" in delivered.deliver(capture, clean=True, **OBJ).problem
    images.write_data(capture.maps / "brows.png", np.eye(SIDE))
    images.write_srgb(capture.maps / "clean_albedo.png", np.full((SIDE, SIDE, 3), 0.5), 16)
    delivered.deliver(capture, clean=True, **OBJ)
    made = textures(capture)
    assert np.allclose(images.read_data(made / "Zoe_et_moi_brows_mask.png")[..., 0], np.eye(SIDE), atol=1e-4)
    assert np.allclose(images.read_data(made / "Zoe_et_moi_albedo.png"), 0.5, atol=1e-4), "in the albedo's place"
    delivered.deliver(capture, hair=False, **OBJ)
    assert not list(made.glob("*brows*"))


@pytest.mark.parametrize(("preset", "factor"), [("blender", 1), ("unity_hdrp", 100)])
def test_the_obj_is_read_by_another_reader_in_the_targets_unit(shared, preset, factor):
    """OBJ has no unit: HDRP's centimetres are larger numbers."""
    target = folder(shared, preset=preset)
    (part,) = trimesh.load_scene(target / "Zoe_et_moi.obj", process=False).geometry.values()
    truth = meshes.read_obj(shared.head)
    corners = np.concatenate(
        [truth.vertices[truth.faces][..., [0, 2, 1]] * [factor, factor, -factor], truth.uvs[truth.face_uvs]], -1
    )
    written = np.concatenate([part.vertices[part.faces], part.visual.uv[part.faces]], -1)
    assert len(part.faces) == len(truth.faces)
    for a, b in ((written, corners), (corners, written)):
        farthest = cKDTree(a.reshape(-1, 5)).query(b.reshape(-1, 5))[0].max()
        assert farthest < 1e-5 * factor, "Y up, face towards Z, each corner with its UV"
    assert part.visual.material.image.size == (SIDE, SIDE)
    lines = (target / "Zoe_et_moi.mtl").read_text().splitlines()
    names = [line.split(maxsplit=1)[1] for line in lines if line.startswith(("map_", "norm"))]
    assert len(names) >= 2 and all((target / name).is_file() for name in names)


def test_a_mesh_of_several_tiles_gets_a_material_for_each(capture):
    delivered.in_tiles(capture)
    assert isinstance(delivered.deliver(capture, what="own_mesh", preset="unreal", **OBJ), Done)
    target = folder(capture, "own_mesh", "unreal")
    albedos = {path.name for path in (target / "textures").glob("*_BaseColor*")}
    assert albedos == {f"T_Zoe_et_moi_BaseColor.{tile}.png" for tile in (1001, 1002)}
    parts = trimesh.load_scene(target / "Zoe_et_moi.obj", process=False).geometry.values()
    shades = sorted(
        (round(np.array(part.visual.material.image)[0, 0, 0] / 255, 2), part.visual.uv[:, 0].min() >= 1)
        for part in parts
    )
    assert shades == [(0.25, False), (0.5, True)]
    assert isinstance(delivered.deliver(capture, what="scan", **OBJ), Done)
    textures = {path.name for path in (folder(capture, "scan") / "textures").iterdir()}
    assert textures == {"Zoe_et_moi_albedo.png", "Zoe_et_moi_lit.png"}


def test_provenance_names_everything_and_no_folder(shared):
    text = (folder(shared) / "provenance.json").read_text()
    record = json.loads(text)
    assert not any(place in text for place in ("anna", str(shared.root.parent), "/home", str(ROOT)))
    assert record["capture"]["sources"] == [{"name": "film.mp4", "bytes": 7, "sha256": "not there any more"}]
    solve = record["stages"]["solve"]
    assert solve["seed"] == 0 and solve["settings"] == {"steps": 20, "prior": "prior"}
    assert record["versions"]["packages"]["numpy"] == np.__version__ and record["versions"]["Python"]
    prior = next(entry for entry in record["weights"] if entry["name"] == "prior.safetensors")
    assert len(prior["sha256"]) == 64 and prior["licence"] == "GPL-3.0-or-later" and prior["notices"]
    files = {path.relative_to(folder(shared)).as_posix() for path in folder(shared).rglob("*.*")}
    assert set(record["files"]) == files - {"provenance.json"}


def test_a_video_that_is_there_is_named_with_its_hash(capture, tmp_path):
    (tmp_path / "film.mp4").write_bytes(b"a film\n")
    capture.set_source(tmp_path / "film.mp4")
    plan = delivery_plan.plan(capture, DeliverSettings(format="obj"))
    record = deliver.provenance.collect(capture, plan, Settings(), lambda: None)
    sha256 = hashlib.sha256(b"a film\n").hexdigest()
    assert record["capture"]["sources"] == [{"name": "film.mp4", "bytes": 7, "sha256": sha256}]


def test_what_was_delivered_before_survives_a_full_disk_and_a_cancel(capture, monkeypatch):
    def contents() -> dict:
        return {path: path.read_bytes() for path in sorted(capture.exports.rglob("*.*")) if path.is_file()}

    delivered.deliver(capture, **OBJ)
    before, calls = contents(), []
    assert isinstance(delivered.deliver(capture, cancelled=lambda: len(calls) > 3 or calls.append(1), **OBJ), Cancelled)

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(deliver.maps, "write", full)
    ended = delivered.deliver(capture, **OBJ)
    assert isinstance(ended, Failed) and "disk is full" in ended.problem
    assert contents() == before
    assert [path.name for path in capture.exports.iterdir()] == [folder(capture).name], "nothing half is left"


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({**OBJ, "folder": "/proc/nowhere"}, "/proc/nowhere"),
        ({"format": "fbx", "whole": True}, "Blender"),
        ({"what": "scan"}, "no scan"),
    ],
)
def test_what_cannot_be_delivered_is_refused_with_a_remedy(shared, settings, words):
    ended = delivered.deliver(shared, **settings)
    assert isinstance(ended, Failed) and words in ended.problem and ended.remedy


def test_the_guide_has_the_tables_as_they_are(capsys):
    assert main(["presets"]) == 0
    assert capsys.readouterr().out.strip() in (ROOT / "docs" / "guide" / "deliver.md").read_text(encoding="utf-8")
