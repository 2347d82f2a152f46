# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The built-in head: frozen, symmetric, closed, laid out without overlap; and the registered one, read once by each stage."""

import importlib
from dataclasses import replace

import numpy as np
import pytest

from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.face import template
from core.face.head import read_filmed_head, read_head
from core.geometry import meshes, raster
from core.settings.settings import from_json
from tests.fixtures.painted_skin import SHORT
from tests.fixtures.photographed_head import capture_of, skin
from tests.fixtures.refused import refused

SIZE = 64
STAGES = ("delight", "texture", "shadow_mask", "solve", "upscale", "transfer")
SETTINGS = {
    "delight": {"delighter": "shading"},
    "texture": {"size": 256},
    "solve": {**SHORT, "skin_tone": "auto", "steps": 4},
    "transfer": {"scan": False},
    "upscale": {"size": 1024, "method": "lanczos"},
}


def test_a_stage_reads_the_head_once(tmp_path, monkeypatch):
    """Of a chain over three small frames."""
    capture, reads, read = capture_of(tmp_path / "face", skin(128), (-20, 0, 20), light=1.0), [], meshes.read_obj
    monkeypatch.setattr(meshes, "read_obj", lambda path: reads.append(path) or read(path))
    for stage in STAGES:
        reads.clear()
        importlib.import_module(f"core.stages.{stage}").run(capture, from_json(SETTINGS), Reporter(stage))
        assert reads.count(capture.head) == 1, stage


def test_what_is_worked_out_from_a_head_is_the_rasters_own_made_once_and_cannot_be_written_to(tmp_path):
    capture, mesh = Capture(tmp_path), template.load()
    meshes.write_obj(capture.head, mesh)
    head = read_head(capture)
    face, bary = raster.rasterize_uv(head.mesh, SIZE)
    assert np.array_equal(head.raster(SIZE)[0], face) and np.array_equal(head.raster(SIZE)[1], bary)
    assert head.raster(SIZE)[0] is head.raster(SIZE)[0] and head.normals is head.normals and head.caster is head.caster
    points, surface = head.interpolate(head.mesh.vertices, SIZE), head.unfold(SIZE)
    assert np.array_equal(points, raster.interpolate(head.mesh.vertices, head.mesh.faces, face, bary))
    assert np.array_equal(surface.covered, face >= 0) and np.array_equal(surface.points, points[surface.covered])
    assert np.allclose(np.linalg.norm(surface.normals, axis=1), 1)
    again = surface.spread(surface.points)
    assert np.array_equal(again[surface.covered], surface.points.astype(np.float32)) and not again[face < 0].any()
    arrays = [head.mesh.vertices, head.mesh.faces, head.mesh.uvs, head.mesh.face_uvs, head.normals, *head.raster(SIZE)]
    for array in (*arrays, surface.points, surface.normals, surface.covered):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_another_mesh_in_the_place_of_the_head_is_refused(tmp_path):
    """It has as many vertices, and what works on a head would take them for the head's."""
    mesh, capture = template.load(), Capture(tmp_path)
    refused(lambda: read_head(capture), "head.obj")
    for other in (
        replace(mesh, uvs=1 - mesh.uvs),
        replace(mesh, uvs=None, face_uvs=None),
        replace(mesh, faces=mesh.faces[::-1], face_uvs=mesh.face_uvs[::-1]),
    ):
        meshes.write_obj(capture.head, other)
        for read in (read_head, read_filmed_head):
            refused(lambda read=read: read(capture), "head.obj")


# every shipped weight depends on this topology and these UVs: never change it
FROZEN = "d77cc1f89fd306ed5b300c0877415150"


def test_topology_and_uvs_are_frozen():
    assert template.template_hash(template.load()) == FROZEN


def test_uvs_cover_the_square_once():
    mesh = template.load()
    assert mesh.uvs.min() >= 0 and mesh.uvs.max() <= 1
    a, b, c = (mesh.uvs[mesh.face_uvs[:, k]] for k in range(3))
    area = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    assert (area > -1e-9).all()  # none is flipped, and together they are the square: so none overlap
    assert area.sum() == pytest.approx(1, abs=1e-3)


def test_the_face_fills_sixty_percent_of_the_square():
    assert (template.mask("face", 512) > 0.5).mean() >= 0.6


def test_every_edge_but_the_necks_rim_has_two_triangles():
    mesh = template.load()
    edges = np.sort(np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    assert count.max() == 2
    rim = mesh.vertices[edges[count == 1]].mean(1)
    assert rim[:, 2].max() < -0.1  # lids, lips and nostrils are closed: the only opening is the neck


def test_landmarks_are_where_their_names_say():
    points = template.landmark_points(template.load())
    assert points[263, 0] > 0.03 and points[33, 0] < -0.03  # the left eye's outer corner at +X
    assert points[1, 1] < points[[263, 33], 1].min() - 0.02  # the nose's tip is the foremost, at -Y
    # chin, mouth, tip, bridge, forehead
    assert points[152, 2] < points[13, 2] < points[1, 2] < points[168, 2] < points[10, 2]
    # pupils
    assert np.linalg.norm(points[[263, 362]].mean(0) - points[[33, 133]].mean(0)) == pytest.approx(0.063, abs=0.003)
    assert (template.landmark_weights() > 0).sum() > 400


def test_the_persons_left_is_right_of_the_middle_of_the_map():
    mesh = template.load()
    face, bary = raster.rasterize_uv(mesh, 64)
    x = raster.interpolate(mesh.vertices, mesh.faces, face, bary)[..., 0]
    assert (x[8:56, 40:60] > 0).all() and (x[8:56, 4:24] < 0).all()


def test_masks_do_not_contradict_each_other():
    skin, lips, brows, face = (template.mask(name, 512) > 0.5 for name in ("skin", "lips", "brows", "face"))
    assert not (skin & (lips | brows)).any() and (lips <= face).all()
    assert sum((template.mask(name, 512) > 0.5).mean() for name in ("face", "ears", "neck", "scalp")) == pytest.approx(
        1, abs=0.01
    )


def test_identities_differ_by_millimetres_and_stay_symmetric_on_average():
    components = template.identity()
    assert np.isfinite(components).all() and len(components) == 40
    rms = np.sqrt((components**2).sum(-1).mean(-1)) * 1000
    assert (np.diff(rms) < 0.05).all() and 1 < rms[0] < 10
