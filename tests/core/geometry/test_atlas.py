# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""New UVs for a mesh: no overlap, little stretch, a filled square, the same every time; and what is wrong with UVs is
found."""

from dataclasses import replace

import numpy as np
import pytest

from core.geometry import atlas, meshes, surfaces
from core.geometry.meshes import Mesh
from tests.fixtures.egg import egg


@pytest.fixture(scope="module")
def unwrapped() -> Mesh:
    mesh = egg(48, 32)
    return atlas.unwrap(Mesh(mesh.vertices, mesh.faces), 512)


def test_an_atlas_has_no_overlap_little_stretch_and_fills_its_square(unwrapped):
    assert atlas.overlap_share(unwrapped) < 0.003 and atlas.faults(unwrapped) == []
    assert 0 <= unwrapped.uvs.min() and unwrapped.uvs.max() <= 1
    assert atlas.packing(unwrapped) > 0.5
    assert (atlas._double_areas(unwrapped.uvs[unwrapped.face_uvs]) > 0).mean() > 0.995, "no chart is a mirror image"
    stretch = atlas.stretch(unwrapped)
    assert np.median(stretch) < 1.2 and np.percentile(stretch, 95) < 1.8 and stretch.min() >= 1 - 1e-6


def test_an_atlas_is_the_same_every_time(unwrapped):
    again = atlas.unwrap(Mesh(unwrapped.vertices, unwrapped.faces), 512)
    assert np.array_equal(again.uvs, unwrapped.uvs) and np.array_equal(again.face_uvs, unwrapped.face_uvs)


def test_stretch_is_the_known_one():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    mesh = Mesh(square, faces, square[:, :2] * 0.3, faces)
    assert np.allclose(atlas.stretch(mesh), 1)
    assert np.allclose(atlas.stretch(replace(mesh, uvs=square[:, :2] * [0.6, 0.15])), 2)


def test_faults_are_told_apart():
    mesh = egg(24, 16)
    assert atlas.faults(mesh) == []
    assert "no UVs" in atlas.faults(Mesh(mesh.vertices, mesh.faces))[0]
    # left on right, as games do
    mirrored = replace(mesh, uvs=np.stack([np.abs(mesh.uvs[:, 0] - 0.5), mesh.uvs[:, 1]], 1))
    assert "overlap" in atlas.faults(mirrored)[0]
    assert "no area" in atlas.faults(replace(mesh, uvs=np.full_like(mesh.uvs, 0.5)))[0]
    assert "left of" in atlas.faults(replace(mesh, uvs=mesh.uvs - [1, 0]))[0]
    beside = replace(
        mesh,
        uvs=np.concatenate([mesh.uvs, mesh.uvs + [1, 0]]),
        face_uvs=np.where((np.arange(len(mesh.faces)) % 2 == 0)[:, None], mesh.face_uvs, mesh.face_uvs + len(mesh.uvs)),
    )
    assert atlas.faults(beside) == [] and {atlas.udim(t) for t in atlas.tiles(beside)} == {1001, 1002}


def test_udim_numbers():
    assert [atlas.udim(tile) for tile in ((0, 0), (9, 0), (0, 1), (3, 2))] == [1001, 1010, 1011, 1024]
    for tile in ((-1, 0), (10, 0), (0, -1)):
        with pytest.raises(ValueError, match="no UDIM"):
            atlas.udim(tile)


def test_split_seams_are_sewn_and_what_only_touches_is_not():
    mesh = egg(24, 16)  # its two ends meet at u = 0 and u = 1
    sewn, index = surfaces.welded(mesh)
    assert len(sewn.vertices) == len(mesh.vertices) - 17 and np.allclose(sewn.vertices[index], mesh.vertices, atol=1e-6)
    a, b, c = mesh.vertices[mesh.faces[100]]
    fin = Mesh(
        np.concatenate([mesh.vertices, [a, b, (a + b) / 2 + [0, 0, 1]]]),
        np.concatenate([mesh.faces, len(mesh.vertices) + np.array([[0, 1, 2]])]),
    )
    assert len(surfaces.welded(fin)[0].vertices) == len(sewn.vertices) + 3


def test_hollow_polygons_are_cut_inside(tmp_path):
    corners = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 0.4 0\n"  # an arrow head, hollow at its last corner
    for order in ("1 2 3 4", "2 3 4 1", "3 4 1 2", "4 1 2 3"):
        around = " ".join(f"{i}/{i}" for i in order.split())
        (tmp_path / "arrow.obj").write_text(f"{corners}vt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0.2\nf {around}\n")
        mesh = meshes.read_obj(tmp_path / "arrow.obj")
        a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
        assert (np.cross(b - a, c - a)[:, 2] > 0).all() and np.array_equal(mesh.faces, mesh.face_uvs)
