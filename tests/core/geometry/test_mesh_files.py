# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh files: unusual ones are read with the right result, damaged ones are refused by name, and nothing that is no
mesh is written."""

import os
import struct
from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("trimesh")

from core.geometry import frame_pictures, meshes  # noqa: E402
from core.geometry.meshes import Mesh  # noqa: E402
from core.imaging import images  # noqa: E402
from tests.fixtures.refused import refused  # noqa: E402

RNG = np.random.default_rng(0)
SQUARE = [((0, 0, 0), (0, 0)), ((1, 0, 0.5), (1, 0)), ((1, 1, 0), (1, 1)), ((0, 1, 0.25), (0, 1))]
"""Corners with their UVs."""
V, VT = [f"v {x} {y} {z}" for (x, y, z), _ in SQUARE], [f"vt {u} {v}" for _, (u, v) in SQUARE]
QUAD = "f 1/1 2/2 3/3 4/4"
CORNERS = "\n".join([*V, *VT, ""])


@pytest.mark.parametrize(
    "lines",
    [
        pytest.param([*V, *VT, "f 1/1 2/2 3/3", "f 1/1 3/3 4/4"], id="triangles"),
        pytest.param([*V, *VT, "f -4/-4 -3/-3 -2/-2 -1/-1"], id="negative indices"),
        pytest.param([*V, *VT, "f -4/-4 -3/-3 \\", " -2/-2 -1/-1", "v 9 9 9", "vt 9 9"], id="line continued"),
        pytest.param(["\ufeff# by hand", *V, "", "#", *VT, QUAD, "# end"], id="byte order mark and comments"),
        pytest.param([*(line + " 0.5 0.25 1" for line in V), *VT, QUAD], id="vertex colours"),
        pytest.param([*V, *(line + " 0" for line in VT), QUAD], id="three texture coordinates"),
        pytest.param([*(line.replace(" ", "\t  ") + "  " for line in V), *VT, QUAD], id="tabs and blanks"),
        pytest.param(["mtllib a b.mtl", "o hëad", *V, *VT, "g skin", "usemtl skin", "s 1", QUAD], id="groups"),
        pytest.param([*V, *VT, "vn 0 0 1", "f 1/1/1 2/2/1 3/3/1 4/4/"], id="normals"),
        pytest.param([*(f"v {x:e} {y:E} {z:+e}" for (x, y, z), _ in SQUARE), *VT, QUAD], id="exponents"),
        pytest.param([*V[:3], *VT[:3], "f 1/1 2/2 3/3", V[3], VT[3], "f 1/1 3/3 4/4"], id="faces among vertices"),
        pytest.param([*V, *VT, "l 1 2", "p 1", QUAD], id="lines and points"),
        pytest.param(["#" + "x" * 100_000, *V, *VT, QUAD], id="long comment"),
    ],
)
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_an_obj_as_other_programs_write_it_is_the_mesh_that_it_was(place, lines, newline):
    path = place(".obj")
    path.write_bytes(newline.join(lines).encode("utf-8" if lines[0][0] == "\ufeff" else "latin-1"))
    mesh = meshes.read_obj(path)
    assert mesh.faces.tolist() == mesh.face_uvs.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert list(zip(map(tuple, mesh.vertices[:4]), map(tuple, mesh.uvs[:4]), strict=True)) == SQUARE


def test_negative_indices_count_from_where_they_stand(tmp_path):
    (tmp_path / "two.obj").write_text("\n".join([*V, "f -4 -3 -2", *V, "f -4 -3 -2"]))
    assert meshes.read_obj(tmp_path / "two.obj").faces.tolist() == [[0, 1, 2], [4, 5, 6]]


@pytest.mark.parametrize(
    ("kind", "code", "extra"),
    [("float", "3f", ""), ("double", "3d3B", "red green blue"), ("float", "3f3B", "red green blue")],
)
@pytest.mark.parametrize(
    ("form", "order"), [("ascii", None), ("binary_little_endian", "<"), ("binary_big_endian", ">")]
)
def test_a_ply_of_every_kind_is_the_mesh_that_it_was(tmp_path, form, order, kind, code, extra):
    vertices = [[*corner, *(0 for _ in extra.split())] for corner, _ in SQUARE]
    faces = [(3, 0, 1, 2), (3, 0, 2, 3)]
    header = [f"ply\nformat {form} 1.0\ncomment made by hand\nelement vertex 4"]
    header += [f"property {kind} {name}" for name in "xyz"] + [f"property uchar {name}" for name in extra.split()]
    header += ["element face 2", "property list uchar int vertex_indices", "end_header\n"]
    if order:
        body = b"".join(struct.pack(order + code, *vertex) for vertex in vertices)
        body += b"".join(struct.pack(order + "B3i", *face) for face in faces)
    else:
        body = "\n".join(" ".join(map(str, row)) for row in [*vertices, *faces]).encode()  # the last line has no end
    (tmp_path / "scan.ply").write_bytes("\n".join(header).encode() + body)
    mesh = meshes.read_ply(tmp_path / "scan.ply")
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.vertices.tolist() == [list(corner) for corner, _ in SQUARE]


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("v nan 0 0\nf 1 2 3\n", "no numbers"),
        ("v 0 inf 0\nf 1 2 3\n", "no numbers"),
        ("v 0 1e300 0\nf 1 2 3\n", "no numbers"),
        ("vt 0 nan\nf 1/1 2/2 3/5\n", "no numbers"),
        ("v 0 zero 0\nf 1 2 3\n", "zero"),
        ("v 0 1\nf 1 2 3\n", "line 9"),
        ("f 1 2 5\n", "not in it"),
        ("f 1/1 2/2 3/5\n", "not in it"),
        ("f 0 1 2\n", "line 9"),
        ("f -5 1 2\n", "line 9"),
        ("f 1 2\n", "line 9"),
        ("f 1 2 x\n", "line 9"),
        (f"f 1 2 {10**30}\n", "damaged"),
        ("", "no faces"),
        ("\0\xff" * 99, "no faces"),
    ],
    ids=count(),
)
def test_damaged_objs(tmp_path, lines, words):
    (tmp_path / "head.obj").write_text(CORNERS + lines)
    refused(lambda: meshes.read_obj(tmp_path / "head.obj"), "head.obj", words)


def test_an_obj_of_our_own_is_read_in_blocks_as_it_is_line_by_line(tmp_path):
    """What is written has six decimals and a UV at every corner; a comment sends it to the other reader."""
    path = tmp_path / "head.obj"
    corners = RNG.integers(0, 40, (2, 50, 3))
    meshes.write_obj(path, Mesh(RNG.normal(0, 0.1, (40, 3)), corners[0], RNG.random((40, 2)), corners[1]))
    text = path.read_text()
    assert meshes.OWN_OBJ.fullmatch(text)
    blocks = meshes.read_obj(path)
    path.write_text(text + "# more\n")
    lines = meshes.read_obj(path)
    for name in ("vertices", "faces", "uvs", "face_uvs"):
        one, other = getattr(blocks, name), getattr(lines, name)
        assert one.dtype == other.dtype and np.array_equal(one, other), name
    for last, words in (
        ("0/1 1/1 2/2", "line 131"),
        ("1/0 1/1 2/2", "line 131"),
        ("1/1 41/1 2/2", "not in it"),
        ("1/1 3/41 2/2", "not in it"),
        ("1/1 2", "line 131"),
    ):
        path.write_text(f"{text}f {last}\n")
        refused(lambda: meshes.read_obj(path), "head.obj", words)
    path.write_text("v 9999999999.000000 0.000000 0.000000\n" + text)
    refused(lambda: meshes.read_obj(path), "head.obj", "no numbers")


SCAN = struct.pack("<12f", 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0) + struct.pack("<BiiiBiii", 3, 0, 1, 2, 3, 0, 2, 3)


@pytest.mark.parametrize(
    ("vertices", "faces", "body"),
    [
        (4, 2, SCAN[:-1]),
        (4, 2, SCAN[:40]),
        (10**12, 2, SCAN),
        (4, 10**15, SCAN),
        (-4, 2, SCAN),
        ("many", 2, SCAN),
        (4, 2, SCAN[:44] + struct.pack("<f", np.nan) + SCAN[48:]),
        (4, 2, SCAN[:44] + struct.pack("<f", np.inf) + SCAN[48:]),
        (4, 2, SCAN[:-4] + struct.pack("<i", 9)),
        (4, 2, SCAN[:-4] + struct.pack("<i", -1)),
        (4, 0, SCAN[:48]),
    ],
    ids=count(),
)
def test_damaged_plys(tmp_path, vertices, faces, body):
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    (tmp_path / "scan.ply").write_bytes(header.encode() + body)
    refused(lambda: meshes.read_ply(tmp_path / "scan.ply"), "scan.ply is damaged")
    (tmp_path / "scan.ply").write_bytes(b"no mesh at all")
    refused(lambda: meshes.read_ply(tmp_path / "scan.ply"), "header")


def test_meshes_that_are_none_are_not_written(tmp_path):
    points, faces = np.eye(3), np.array([[0, 1, 2]])
    infinite = Mesh(points, faces, np.full((3, 2), np.inf), faces)
    for mesh in (Mesh(points * np.nan, faces), Mesh(points, faces + 1), Mesh(points, faces[:0]), infinite):
        for write, name in ((meshes.write_obj, "head.obj"), (meshes.write_ply, "scan.ply")):
            refused(lambda write=write, name=name, mesh=mesh: write(tmp_path / name, mesh), name, "was not written")
            assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes here")
@pytest.mark.parametrize(("name", "read"), [("a.obj", meshes.read_obj), ("a.ply", meshes.read_ply)])
def test_a_pipe_under_a_meshs_name_is_refused_and_not_waited_for(tmp_path, name, read):
    os.mkfifo(tmp_path / name)
    refused(lambda: read(tmp_path / name), name)


@pytest.mark.parametrize(("side", "right"), [(1, False), (7, False), (8, True), (64, True), (128, True)])
def test_pictures_of_frames_have_their_shape(tmp_path, side, right):
    def read():
        view = SimpleNamespace(width=64, height=64, name="1.jpg")
        return frame_pictures.read_picture(tmp_path / "1.png", view, "delit")

    images.write_srgb(tmp_path / "1.png", np.ones((side, side, 3)))
    if right:
        assert read().shape == (64, 64, 3)
    else:
        refused(read, "1.png", f"{side} x {side}")
