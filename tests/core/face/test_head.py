# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The registered head: read once by each stage that works on it, and shared without being written to."""

import importlib
from dataclasses import replace

import numpy as np
import pytest

from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.face import template
from core.face.head import Head, read_filmed_head, read_head
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


@pytest.fixture(scope="module")
def reads(tmp_path_factory) -> dict[str, int]:
    """Stage -> how often it read head.obj, of a chain over four small frames."""
    capture, found = capture_of(tmp_path_factory.mktemp("chain") / "face", skin(128), (-20, 0, 20), light=1.0), []
    read, counted = meshes.read_obj, {}
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(meshes, "read_obj", lambda path: found.append(path) or read(path))
        for stage in STAGES:
            found.clear()
            importlib.import_module(f"core.stages.{stage}").run(capture, from_json(SETTINGS), Reporter(stage))
            counted[stage] = found.count(capture.head)
    return counted


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_reads_the_head_once(reads, stage):
    assert reads[stage] == 1


def test_what_is_worked_out_from_a_head_is_the_rasters_own_and_made_once():
    mesh = template.load()
    head = Head(mesh)
    face, bary = raster.rasterize_uv(mesh, SIZE)
    assert np.array_equal(head.raster(SIZE)[0], face) and np.array_equal(head.raster(SIZE)[1], bary)
    assert head.raster(SIZE)[0] is head.raster(SIZE)[0] and head.normals is head.normals and head.caster is head.caster
    assert np.array_equal(
        head.interpolate(mesh.vertices, SIZE), raster.interpolate(mesh.vertices, mesh.faces, face, bary)
    )
    surface = head.unfold(SIZE)
    assert np.array_equal(surface.covered, face >= 0)
    assert np.array_equal(surface.points, head.interpolate(mesh.vertices, SIZE)[surface.covered])
    assert np.allclose(np.linalg.norm(surface.normals, axis=1), 1)
    again = surface.spread(surface.points)
    assert np.array_equal(again[surface.covered], surface.points.astype(np.float32)) and not again[face < 0].any()


def test_what_is_shared_cannot_be_written_to(tmp_path):
    capture = Capture(tmp_path)
    meshes.write_obj(capture.head, template.load())
    head = read_head(capture)
    surface = head.unfold(SIZE)
    mesh = [head.mesh.vertices, head.mesh.faces, head.mesh.uvs, head.mesh.face_uvs]
    for array in (*mesh, head.normals, *head.raster(SIZE), surface.points, surface.normals, surface.covered):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_a_capture_without_a_head_is_a_problem(tmp_path):
    refused(lambda: read_head(Capture(tmp_path)), "head.obj")


@pytest.mark.parametrize("change", ["other UVs", "no UVs", "other triangles"])
def test_another_mesh_in_the_place_of_the_head_is_refused(tmp_path, change):
    """It has as many vertices, and what works on a head would take them for the head's."""
    mesh, capture = template.load(), Capture(tmp_path)
    other = {
        "other UVs": replace(mesh, uvs=1 - mesh.uvs),
        "no UVs": replace(mesh, uvs=None, face_uvs=None),
        "other triangles": replace(mesh, faces=mesh.faces[::-1], face_uvs=mesh.face_uvs[::-1]),
    }[change]
    meshes.write_obj(capture.head, other)
    for read in (read_head, read_filmed_head):
        refused(lambda read=read: read(capture), "head.obj")
