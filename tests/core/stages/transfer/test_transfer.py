# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps baked into other UVs: known functions of position arrive where they belong, seams or not; and the scan is
delivered."""

import json
import shutil
from dataclasses import replace
from itertools import product

import cv2
import numpy as np
import pytest

from core.capture import retouch_edits, retouch_layers, stages
from core.capture.capture import Capture
from core.capture.messages import CancelledError, Problem, Reporter
from core.geometry import atlas, baking, meshes, raster, surfaces
from core.geometry.meshes import Mesh, vertex_normals
from core.imaging import images
from core.settings.settings import from_json
from core.stages import transfer
from core.stages.transfer import scan
from tests.fixtures import recorded
from tests.fixtures.egg import egg
from tests.fixtures.photographed_head import capture_of, head, skin

SIZE = 256


def colour_at(points: np.ndarray) -> np.ndarray:
    """A smooth function of position [N, 3] -> [N, 3] in about 0.2 to 0.8."""
    return (0.5 + 0.3 * np.sin(points @ np.array([[55.0, 20, 0], [0, 45, 30], [35, 0, 50]]).T)).astype(np.float32)


def painted(mesh: Mesh, size: int, values=lambda points, face, bary: colour_at(points)) -> np.ndarray:
    """values(points, face, bary) at the texels of a mesh's map [size, size, 3], bled."""
    face, bary = raster.rasterize_uv(mesh, size)
    inside, out = face >= 0, np.zeros((size, size, 3), np.float32)
    points = raster.interpolate(mesh.vertices, mesh.faces, face[inside], bary[inside])
    out[inside] = values(points, face[inside], bary[inside])
    return raster.bleed(out, inside)


def frames_of(mesh: Mesh, face, bary):
    whole = surfaces.welded(mesh)[0]
    return surfaces.frames(vertex_normals(whole), whole.faces, *surfaces.tangents(whole), face, bary.astype(np.float64))


@pytest.fixture(scope="module")
def source() -> baking.Source:
    return baking.Source(egg(96, 64))


@pytest.fixture(scope="module")
def target() -> Mesh:
    """The same egg with half as many triangles, seams elsewhere, half of it in tile 1002, and the chart of that half
    mirrored."""
    mesh = egg(70, 46)
    whole = surfaces.welded(mesh)[0]
    other = atlas.unwrap(Mesh(whole.vertices, whole.faces), SIZE)
    left = other.vertices[other.faces].mean(1)[:, 0] > 0
    uvs = np.concatenate([other.uvs, [2, 0] + other.uvs * [-1, 1]])
    return replace(other, uvs=uvs, face_uvs=np.where(left[:, None], other.face_uvs + len(other.uvs), other.face_uvs))


def places_of(target, tile, source, size=SIZE):
    return baking.places(target, tile, source, size, 0.004, lambda done: None)


@pytest.mark.parametrize("tile", [(0, 0), (1, 0)])
def test_a_function_of_position_arrives_and_seams_are_no_worse(source, target, tile):
    at = places_of(target, tile, source)
    baked = baking.bake(painted(source.mesh, 768), at)
    part = atlas.in_tile(target, tile, (atlas.tiles(target) == tile).all(1))
    face, bary = raster.rasterize_uv(part, SIZE)
    truth = colour_at(raster.interpolate(part.vertices, part.faces, face[at.covered], bary[at.covered]))
    error = np.zeros((SIZE, SIZE))
    error[at.covered] = np.abs(baked[at.covered] - truth).max(1)
    rim = at.covered & (cv2.erode(at.covered.astype(np.uint8), np.ones((5, 5))) == 0)
    inner = at.covered & ~rim
    assert at.known[at.covered].mean() > 0.998
    assert np.percentile(error[inner], 99.5) < 0.01
    assert np.percentile(error[rim], 99.5) < 1.3 * np.percentile(error[inner], 99.5) + 0.002
    outside = ~at.covered & (cv2.dilate(at.covered.astype(np.uint8), np.ones((5, 5))) > 0)
    nearest = raster.bleed(baked, at.covered)
    assert np.abs(baked - nearest)[outside].max() < 1e-6, "charts bleed"
    assert np.isfinite(baked).all() and baked.min() > 0.1


def test_normals_are_turned_into_the_other_tangent_frame(source, target):
    lean = np.array([0.4, -0.2, 0.5])

    def world(n):
        leaning = n + 0.5 * (lean - (n @ lean)[:, None] * n)
        return leaning / np.linalg.norm(leaning, axis=1, keepdims=True)

    def packed(points, face, bary):
        t, b, n = frames_of(source.mesh, face, bary)
        w = world(n)
        return (np.stack([(w * t).sum(1), (w * b).sum(1), (w * n).sum(1)], 1) * 0.5 + 0.5).astype(np.float32)

    source_map = painted(source.mesh, 768, packed)
    for tile, mirrored in (((0, 0), False), ((1, 0), True)):
        at = places_of(target, tile, source)
        assert at.mirrored[at.known].mean() == mirrored
        baked = baking.bake_normals(source_map, at)[at.known] * 2 - 1
        where = (atlas.tiles(target) == tile).all(1)
        face, bary = raster.rasterize_uv(atlas.in_tile(target, tile, where), SIZE)
        t, b, n = frames_of(target, np.flatnonzero(where)[face[at.known]], bary[at.known])
        got = baked[:, :1] * t + baked[:, 1:2] * b + baked[:, 2:] * n
        off = np.degrees(np.arccos(np.clip((got * world(n)).sum(1) / np.linalg.norm(got, axis=1), -1, 1)))
        assert np.median(off) < 0.6 and np.percentile(off, 99) < 3
        turned = np.degrees(np.arccos(np.clip((n * world(n)).sum(1), -1, 1)))
        assert np.median(turned) > 10, "there was something to carry"


def test_strips_do_not_show(source, target, monkeypatch):
    whole = places_of(target, (0, 0), source, 128)
    monkeypatch.setattr(baking, "STRIP_ROWS", 37)
    strips = places_of(target, (0, 0), source, 128)
    assert np.allclose(whole.uv, strips.uv, atol=1e-5, equal_nan=True) and np.array_equal(whole.covered, strips.covered)


def test_a_surface_that_faces_away_is_no_partner():
    outer, inner = egg(48, 32), egg(48, 32).vertices * 0.97
    faces = np.concatenate([outer.faces, outer.faces[:, ::-1] + len(inner)])
    shell = Mesh(np.concatenate([outer.vertices, inner]), faces)
    middle = np.abs(outer.uvs[:, 1] - 0.5) < 0.4  # nearer to the inner sheet, which faces the other way
    points, normals = outer.vertices[middle] * 0.98, vertex_normals(outer)[middle]
    face, _ = surfaces.Surface(shell).find_partners(points, normals, 0.02)
    assert (face >= 0).all() and (face < len(outer.faces)).all()


def test_the_reduced_scan_is_a_clean_surface_near_the_scan():
    rng = np.random.default_rng(0)
    fine = surfaces.welded(egg(200, 140))[0]
    speck = Mesh(np.array([[0.2, 0, 0], [0.201, 0, 0], [0.2, 0.001, 0]]), np.array([[0, 1, 2]]))
    noisy = Mesh(
        np.concatenate([fine.vertices + rng.normal(0, 3e-4, fine.vertices.shape), speck.vertices]),
        np.concatenate([fine.faces, speck.faces + len(fine.vertices)]),
    )
    mesh = scan.reduce(noisy, 0.005)
    _, uses = np.unique(np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0, return_counts=True)
    assert uses.max() <= 2 and len(mesh.faces) < len(fine.faces) / 4 and mesh.vertices[:, 0].max() < 0.1
    face, bary = surfaces.Surface(fine).find_nearest(mesh.vertices, vertex_normals(mesh), 0.01)
    gap = np.linalg.norm(raster.interpolate(fine.vertices, fine.faces, face, bary) - mesh.vertices, axis=1)[face >= 0]
    assert (face >= 0).mean() > 0.99 and np.median(gap) < 5e-4


def test_the_displacement_is_the_known_one_in_metres():
    mesh = egg(48, 32)
    half = mesh.moved(mesh.vertices + 0.002 * vertex_normals(surfaces.welded(mesh)[0])[surfaces.welded(mesh)[1]])
    front = replace(half, faces=half.faces[half.vertices[half.faces].mean(1)[:, 1] < 0], uvs=None, face_uvs=None)
    height = scan.displacement(mesh, front, 64, lambda done: None)
    assert np.isclose(np.median(height[20:45, 24:40]), 0.002, atol=1e-4)
    assert (height[:, :10] == 0).all() and height.max() < 0.003


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Capture:
    """A head that is its own scan, photographed with its own skin, and its maps solved."""
    texture = skin(256)
    capture = capture_of(tmp_path_factory.mktemp("finished") / "é.wildcap", texture, (-30, 0, 30), light=1.0)
    meshes.write_ply(capture.scan, head())
    for name in stages.MAPS:
        shape = (256, 256) if name in ("specular_albedo.png", "confidence.png") else (256, 256, 3)
        images.write_data(capture.maps / name, np.full(shape, 0.5, np.float32))
    images.write_linear(capture.maps / "diffuse_albedo.exr", texture * 1.2)
    return capture


@pytest.fixture
def capture(finished, tmp_path) -> Capture:
    return Capture(shutil.copytree(finished.root, tmp_path / finished.root.name))


def settings_of(**values):
    return from_json({"transfer": {"size": 256, "scan_size": 256, "scan_detail_mm": 4.0, **values}})


def test_the_scan_is_delivered_with_its_colours(capture):
    report = Reporter("transfer")
    transfer.run(capture, settings_of(), report)
    names = "delivery.json scan.obj scan_lit.png scan_albedo.png scan_albedo_known.png scan_skin_weight.png displacement.exr"
    assert {path.name for path in capture.delivery.iterdir()} == set(names.split())
    mesh = meshes.read_obj(capture.delivery / "scan.obj")
    assert atlas.overlap_share(mesh) < 0.01
    lit, albedo = (images.read_linear(capture.delivery / f"scan_{name}.png") for name in ("lit", "albedo"))
    face, bary = raster.rasterize_uv(mesh, 256)
    points = raster.interpolate(mesh.vertices, mesh.faces, face, bary)
    front = (face >= 0) & (points[..., 1] < -0.06)
    assert np.median(np.abs(albedo / lit - 1.2)[front]) < 0.06, "the maps are a fifth brighter than the frames"
    assert report.figures["scan_albedo_known_percent"] > 95 and report.figures["displacement_p95_mm"] < 0.5
    assert capture.picture("transfer", "scan").is_file()
    assert "metres" in json.loads((capture.delivery / "delivery.json").read_text())["scan"]["displacement"]


def test_tiles_of_the_artists_mesh_are_baked_and_named(capture, target):
    meshes.write_obj(capture.own_head, target)
    capture.own_head_skin.write_text(json.dumps({"skin_triangles": [[0, len(target.faces)]]}))
    transfer.run(capture, settings_of(scan=False), Reporter("transfer"))
    kinds = product(("diffuse_albedo", "specular_albedo", "normal", "confidence", "skin_weight"), (1001, 1002))
    names = {"delivery.json", "own_head.obj", *(f"own_{kind}.{tile}.png" for kind, tile in kinds)}
    assert {path.name for path in capture.delivery.iterdir()} == names
    assert (capture.delivery / "own_head.obj").read_bytes() == capture.own_head.read_bytes()
    assert images.read_mask(capture.delivery / "own_confidence.1002.png").max() > 0.5
    weight = images.read_mask(capture.delivery / "own_skin_weight.1002.png")
    assert weight.max() > 0.99 and weight.min() < 0.01, "skin, and brows or what has no partner"


def test_what_was_retouched_is_baked_into_the_artists_mesh(capture, target):
    meshes.write_obj(capture.own_head, target)
    capture.own_head_skin.write_text(json.dumps({"skin_triangles": [[0, len(target.faces)]]}))
    capture.json.write_text('{"format": 2, "source": "", "stages": {}}', encoding="utf-8")
    for folder in (capture.maps_4k, capture.maps_retouched):
        shutil.copytree(capture.maps, folder)
    layer = retouch_edits.add_layer(capture, "Blue", "albedo")
    images.write_packed(retouch_layers.picture_of(capture, layer), np.ones((256, 256, 4), np.float32), bits=16)
    blue = np.broadcast_to(np.float32([0.02, 0.03, 0.6]), (256, 256, 3))
    images.write_linear(capture.maps_retouched / "diffuse_albedo.exr", blue)
    for name in ("upscale", "retouch"):
        recorded.record(capture, stages.by_name(name), settings_of())
    report = Reporter("transfer")
    transfer.run(capture, settings_of(scan=False), report)
    assert report.figures["maps_from"] == "maps_retouched"
    baked = images.read_linear(capture.delivery / "own_diffuse_albedo.1001.png")
    known = images.read_mask(capture.delivery / "own_confidence.1001.png") > 0.1
    assert known.any() and np.abs(baked[known] - (0.02, 0.03, 0.6)).max() < 4e-3


def test_nothing_half_done_stays_and_without_a_scan_there_is_still_a_delivery(capture):
    with pytest.raises(CancelledError):
        transfer.run(capture, settings_of(), Reporter("transfer", cancelled=lambda: True))
    assert not capture.delivery.exists() and not list(capture.root.glob(".delivery*"))
    meshes.write_points(capture.scan, np.eye(3))  # where no surface was measured
    transfer.run(capture, settings_of(), Reporter("transfer"))
    assert [path.name for path in capture.delivery.iterdir()] == ["delivery.json"]
    capture.head.write_text("v 0 0 0\n")
    with pytest.raises(Problem):
        transfer.run(capture, settings_of(), Reporter("transfer"))
