# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's own head mesh: any units, axes and polygons; where each of its vertices belongs is known for a made
one."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from core.capture.messages import Problem, Reporter
from core.face import template
from core.geometry import atlas, meshes
from core.settings.settings import from_json
from core.stages import registration
from core.stages.registration import alignment, carried, own_mesh, own_template, render_landmarks
from tests.fixtures.egg import egg
from tests.fixtures.own_heads import lay_over, person
from tests.fixtures.refused import refused

TO_Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
EYES = np.array([[-0.0315, -0.004, 0.0], [0.0315, -0.004, 0.0]])


def coarse(folder: Path) -> tuple[Path, np.ndarray]:
    """The neutral head with a third of its vertices, of quads and triangles, with eyeballs, in centimetres and Y up;
    and which vertices of ours they are."""
    mesh = template.load()
    place = np.floor(mesh.vertices / 0.0055).astype(np.int64)
    _, of = np.unique(place, axis=0, return_inverse=True)
    mean = np.stack([np.bincount(of, mesh.vertices[:, i]) for i in range(3)], 1) / np.bincount(of)[:, None]
    distance = np.linalg.norm(mesh.vertices - mean[of], axis=1)
    members_of = np.split(np.argsort(of, kind="stable"), np.cumsum(np.bincount(of))[:-1])
    chosen = np.array([members[distance[members].argmin()] for members in members_of])
    faces = of[mesh.faces]
    faces = faces[(faces != np.roll(faces, 1, 1)).all(1)]
    faces = faces[np.sort(np.unique(np.sort(faces, 1), axis=0, return_index=True)[1])]
    uv = np.zeros((len(mesh.vertices), 2))
    uv[mesh.faces] = mesh.uvs[mesh.face_uvs]
    ball = trimesh.creation.icosphere(2, 0.0115)
    points = np.concatenate([mesh.vertices[chosen], ball.vertices + EYES[0], ball.vertices + EYES[1]]) @ TO_Y_UP.T * 100
    polygons, quads, beside = [], set(), {}
    for first, second in trimesh.graph.face_adjacency(faces).tolist():
        beside.setdefault(first, second)
    for f, corners in enumerate(faces.tolist()):
        other = beside.get(f)
        if f in quads:
            continue
        if other is not None and other > f and other not in quads and f % 3:
            lone = next(v for v in faces[other] if v not in corners)
            at = next(i for i in range(3) if corners[i] in faces[other] and corners[(i + 1) % 3] in faces[other])
            corners = [corners[at], lone, corners[(at + 1) % 3], corners[(at + 2) % 3]]
            quads.add(other)
        polygons.append(corners)
    lines = ["o Head", *(f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in points)]
    lines += [f"vt {u:.6f} {v:.6f}" for u, v in uv[chosen]]
    lines += ["f " + " ".join(f"{v + 1}/{v + 1}" for v in polygon) for polygon in polygons] + ["g Eyes"]
    for offset in (len(chosen), len(chosen) + len(ball.vertices)):
        lines += [f"f {a}/1 {b}/1 {c}/1" for a, b, c in ball.faces + offset + 1]
    path = folder / "coarse head.obj"
    path.write_text("\n".join(lines) + "\n")
    return path, chosen


def test_a_made_mesh_goes_where_its_vertices_belong(tmp_path):
    truth, ours = person()
    path, chosen = coarse(tmp_path)
    capture, report = lay_over(path, tmp_path / "face.wildcap", (4, 3), new_atlas=True)
    mesh, neutral = meshes.read_obj(capture.own_head), template.load().vertices
    error = np.linalg.norm(mesh.vertices[: len(chosen)] - truth.vertices[chosen], axis=1)
    face = registration.weights_of(registration.load_model())[0][chosen] > 0.5
    by_scale = alignment.similarity(neutral, truth.vertices, np.ones(len(neutral))).apply(neutral)
    apart = np.linalg.norm(by_scale - truth.vertices, axis=1)[chosen][face]
    assert np.median(apart) > 0.002, "the person differs from the neutral head"
    assert np.median(error[face]) < 0.001 and np.percentile(error[face], 95) < 0.002
    assert report.figures["own_to_head_median_mm"] < 0.15 and report.figures["own_flipped_triangles"] <= 5
    for eye, middle in zip(np.split(mesh.vertices[len(chosen) :], 2), EYES, strict=True):
        radius = np.linalg.norm(eye - eye.mean(0), axis=1)
        nearest = truth.vertices[np.linalg.norm(template.load().vertices - middle - [0, -0.012, 0], axis=1).argmin()]
        assert np.ptp(radius) < 2e-4 and 0.010 < radius.mean() < 0.0135, "a ball stays a ball"
        assert np.linalg.norm(eye.mean(0) - nearest) < 0.022
    assert capture.picture("registration", "own_template").is_file()
    own_template.run(capture, from_json({}), truth, ours, report)
    assert not capture.own_head.exists() and not capture.own_head_skin.exists()


def test_only_positions_change_in_the_artists_file(tmp_path):
    path = tmp_path / "quads.obj"
    uvs, faces = ["vt 0.100 0.2", "vt 0.9 0.2", "vt 0.9 0.8", "vt 0.1 0.8"], ["f 1/1 2/2 3/3 4/4", "f 5/1 6/2 3/3 1/1"]
    places = [f"v {x} {x * x} {x % 2}" for x in range(300)]
    path.write_text("\n".join(["mtllib a.mtl", "o Head", *places, *uvs, "g Skin", *faces]) + "\n")
    own = own_mesh.read(str(path), Reporter("x"))
    own_mesh.write(tmp_path / "out.obj", own, own.mesh.vertices + [1, 0, 0])
    lines = (tmp_path / "out.obj").read_text().splitlines()
    assert lines[0] == "o Head" and lines[1] == "v 1.000000 0.000000 0.000000"
    assert lines[301:] == [*uvs, "g Skin", *faces]


def test_uvs_that_cannot_be_baked_into_are_refused_until_an_atlas_is_allowed(tmp_path):
    mesh = egg(24, 16)
    path = tmp_path / "no uvs.obj"
    meshes.write_obj(path, meshes.Mesh(mesh.vertices, mesh.faces))
    own, skin = own_mesh.read(str(path), Reporter("x")), np.ones(len(mesh.faces), bool)
    with pytest.raises(Problem, match="no UVs") as problem:
        own_mesh.with_usable_uvs(own, skin, False, 512)
    assert "--new-atlas" in problem.value.remedy
    unwrapped, uvs = own_mesh.with_usable_uvs(own, skin, True, 512)
    assert uvs == "a new atlas" and atlas.overlap_share(unwrapped.mesh) < 0.01
    own_mesh.write(tmp_path / "out.obj", unwrapped, mesh.vertices)
    back = meshes.read_obj(tmp_path / "out.obj")
    assert np.array_equal(back.faces, mesh.faces)
    assert np.allclose(back.uvs[back.face_uvs], unwrapped.mesh.uvs[unwrapped.mesh.face_uvs], atol=1e-6)


@pytest.mark.parametrize(
    ("last", "match"),
    [("", "no faces"), ("f 1 2 3\n", "3 vertices"), ("v 0 0 nan\nf 1 2 4\n", "no numbers"), ("f 1 2 9\n", "not in it")],
)
def test_what_is_no_head_mesh_is_refused(tmp_path, last, match):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 1\n" + last)
    refused(lambda: own_mesh.read(str(tmp_path / "a.obj"), Reporter("x")), match)


def test_a_folder_needs_one_neutral_and_shapes_of_it(tmp_path):
    def read(path=tmp_path):
        return own_mesh.read(str(path), Reporter("x"))

    refused(read, "neutral")
    refused(lambda: read(tmp_path / "gone.obj"), "no head mesh")
    mesh = template.load()
    moved = mesh.moved(mesh.vertices + [0, 0, 0.01])
    for name, shape in (("Neutral", mesh), ("identity000", moved), ("smile", moved)):
        meshes.write_obj(tmp_path / f"{name}.obj", shape)
    shapes = read().shapes
    assert np.allclose(shapes[0, :, 2], 0.01, atol=1e-5)
    assert np.allclose(shapes[1, :, 2], 0.01 * own_mesh.EXPRESSION_SIGMA, atol=1e-5)
    (tmp_path / "smile.obj").write_text("v 0 0 0\n")
    refused(read, "1 vertices")


def test_a_mesh_without_a_face_is_refused(monkeypatch):
    monkeypatch.setattr(render_landmarks, "_turns", lambda: [np.eye(3)])
    ball = trimesh.creation.icosphere(4, 1.0)
    mesh = meshes.Mesh(ball.vertices, ball.faces)
    refused(lambda: render_landmarks.find(mesh, "ball.obj", Reporter("x")), "No face was found", "ball.obj")


def test_parts_without_a_counterpart_follow_the_skin_around_them():
    skin = trimesh.creation.icosphere(4, 0.1)
    ball = trimesh.creation.icosphere(2, 0.01)
    ball.vertices += [0, 0, 0.085]
    start = np.concatenate([skin.vertices, ball.vertices])
    label = np.repeat([0, 1], [len(skin.vertices), len(ball.vertices)])
    moved = skin.vertices * 1.1 + [0.01, 0, 0]
    final = carried.carry_along(start, label, np.arange(len(skin.vertices)), moved, Reporter("x"))
    assert np.allclose(final[: len(moved)], moved)
    assert np.linalg.norm(final[len(moved) :].mean(0) - [0.01, 0, 0.0935]) < 0.001
    assert np.ptp(np.linalg.norm(final[len(moved) :] - final[len(moved) :].mean(0), axis=1)) < 1e-6


def test_it_is_found_however_it_lies():
    turn = render_landmarks._turns()[7]
    mesh = template.load()
    pose = render_landmarks._find_pose(mesh.moved(mesh.vertices @ turn * 37 + [500, -3, 20]), "head.obj", Reporter("x"))
    assert np.allclose(pose.turn, turn)
