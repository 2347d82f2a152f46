# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Registration against a known head: identity, pose, landmarks and scan are made, and must be found again."""

import json

import numpy as np
import pytest
from scipy.spatial import cKDTree

from core.capture.capture import Capture
from core.capture.messages import Problem, Reporter
from core.face import template
from core.geometry import meshes
from core.geometry.meshes import Mesh
from core.geometry.views import read_views
from core.imaging import images
from core.settings.settings import from_json
from core.stages import registration
from core.stages.registration import alignment, landmarks, nonrigid
from core.stages.registration.correspondence import Scan
from tests.fixtures.photographed_head import HEIGHT, WIDTH, write_cameras

AZIMUTHS = (-40, -25, -10, 5, 20, 35)


@pytest.fixture(scope="module")
def known():
    """(model, true vertices in the world, true landmarks, true similarity) of one person."""
    model = registration.load_model()
    coefficients = np.random.default_rng(3).normal(0, 0.8, len(model.identity))
    angle = 0.2
    rotation = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    pose = alignment.Similarity(1.05, rotation, np.array([0.01, -0.02, 0.03]))
    vertices = pose.apply(model.shape(coefficients))
    return model, vertices, model.at_landmarks(vertices), pose


def scan_of(model, vertices, holes=()):
    """A dense mesh of the front of a head, one triangle made four, without what lies within 10 mm of `holes`."""
    import trimesh

    dense, faces = trimesh.remesh.subdivide(vertices, model.mesh.faces)
    kept = dense[:, 1] < vertices[:, 1].min() + 0.12
    for hole in holes:
        kept &= np.linalg.norm(dense - hole, axis=1) > 0.010
    faces = faces[kept[faces].all(1)]
    used, index = np.unique(faces, return_inverse=True)
    return Mesh(dense[used], index.reshape(-1, 3))


def test_similarity_is_found_exactly():
    rng = np.random.default_rng(0)
    source = rng.normal(size=(20, 3))
    rotation = alignment._rotation(np.array([0.3, -1.1, 0.7]))
    found = alignment.similarity(source, 2.5 * source @ rotation.T + [1, 2, 3], rng.uniform(0.1, 1, 20))
    assert np.allclose(found.rotation, rotation) and np.isclose(found.scale, 2.5)
    assert np.allclose(found.translation, [1, 2, 3])


def test_landmarks_are_lifted_although_one_view_is_wrong(tmp_path, known):
    points = known[2]
    views = _views(tmp_path, points.mean(0))
    noise = np.random.default_rng(0).normal(0, 0.3, (len(views), len(points), 2))
    pixels = np.stack([view.project(points)[0] for view in views]) + noise
    pixels[1] += [25, -10]
    found = landmarks.triangulate(views, pixels)
    error = np.linalg.norm(found.points - points, axis=1)
    front = np.abs(points - points.mean(0))[:, 0] < 0.04
    assert np.isfinite(error[front]).mean() > 0.9
    assert np.nanmedian(error[front]) < 0.001 and np.nanpercentile(error[front], 95) < 0.003
    assert not found.images[views[1].name][1].any(), "the wrong view is not used"
    assert found.images[views[3].name][1].mean() > 0.8


def test_a_known_head_is_recovered(known):
    model, truth, points, pose = known
    cheek = truth[template_vertex(model, u=0.68, v=0.42)]
    scan = Scan(scan_of(model, truth, [cheek]))
    trust = np.ones(468)
    follow, shaped, hold = registration.weights_of(model)

    first, coefficients = alignment.fit_landmarks(model, points, trust)
    assert abs(first.scale / pose.scale - 1) < 0.02
    near, coefficients = alignment.fit_scan(model, first, coefficients, points, trust, scan, shaped)
    start = near.apply(model.shape(coefficients))
    vertices = nonrigid.fit(model, start, scan, follow, nonrigid.LandmarkTargets(points, trust, hold), 12)

    error = np.linalg.norm(vertices - truth, axis=1)
    by_landmarks = np.linalg.norm(first.apply(model.mesh.vertices) - truth, axis=1)
    face = follow > 0.5
    assert np.median(by_landmarks[face]) > 0.002, "the person differs from the neutral head"
    assert np.median(error[face]) < 0.0005 and np.percentile(error[face], 95) < 0.002
    to_scan = cKDTree(scan.points).query(vertices[face & (np.linalg.norm(truth - cheek, axis=1) > 0.015)])[0]
    assert np.median(to_scan) < 0.0005
    hole = np.linalg.norm(truth - cheek, axis=1) < 0.010
    assert hole.sum() > 20 and error[hole].max() < 0.0015, "a hole in the scan is bridged"
    assert np.percentile(error[~face], 90) < 0.015, "ears, scalp and neck come along"
    assert nonrigid.flipped_triangles(model.mesh.moved(truth), model.mesh.moved(vertices)) == 0


def test_the_stage_writes_a_head_of_the_frozen_topology(tmp_path, monkeypatch, known):
    model, truth, points, _ = known
    capture = _capture(tmp_path / "Café Müller.wildcap", truth, model, points, monkeypatch)
    report = Reporter("registration")
    registration.run(capture, from_json({"registration": {"iterations": 8}}), report)
    head = meshes.read_obj(capture.head)
    assert template.template_hash(head) == template.template_hash(template.load())
    follow = registration.weights_of(model)[0] > 0.5
    assert np.median(np.linalg.norm(head.vertices - truth, axis=1)[follow]) < 0.001
    assert report.figures["flipped_triangles"] == 0 and report.figures["head_to_scan_median_mm"] < 0.5
    stored = json.loads(capture.landmarks.read_text())
    assert np.linalg.norm(np.array(stored["points"]["152"]) - points[152]) < 0.001
    assert set(stored["images"]) == {view.name for view in read_views(capture)}
    assert capture.picture("registration", "wireframe").is_file()


def test_a_scan_of_something_else_is_a_problem(tmp_path, monkeypatch, known):
    model, truth, points, _ = known
    capture = _capture(
        tmp_path / "other", truth, model, points, monkeypatch, lambda mesh: mesh.moved(mesh.vertices + [0, 0.3, 0])
    )
    with pytest.raises(Problem, match="could not be laid over the scan"):
        registration.run(capture, from_json({"registration": {"iterations": 3}}), Reporter("registration"))
    assert not capture.head.exists()


def test_frames_without_a_face_are_a_problem(tmp_path, monkeypatch, known):
    model, truth, points, _ = known
    monkeypatch.undo()
    capture = _capture(tmp_path / "empty", truth, model, points, None)
    with pytest.raises(Problem, match="face was found in only 0"):
        registration.run(capture, from_json({}), Reporter("registration"))


def template_vertex(model, u, v):
    corner = np.linalg.norm(model.mesh.uvs - [u, v], axis=1).argmin()
    return model.mesh.faces[model.mesh.face_uvs == corner][0]


def _views(root, middle):
    capture = Capture(root)
    capture.frames.mkdir(parents=True)
    names = [f"{i:05d}.jpg" for i in range(len(AZIMUTHS))]
    frames = [
        {"name": name, "video_frame": i, "time_s": i / 24, "sharpness": 1.0, "selected": True}
        for i, name in enumerate(names)
    ]
    capture.frames_json.write_text(json.dumps({"frames": frames}))
    write_cameras(capture.cameras, names, AZIMUTHS, height=float(middle[2]))
    for name in names:
        images.write_srgb(capture.frames / name, np.full((HEIGHT, WIDTH, 3), 0.5, np.float32))
    return read_views(capture)


def _capture(root, truth, model, points, monkeypatch, change=lambda mesh: mesh):
    """A capture up to the scan; its landmarks are given instead of detected, unless monkeypatch is None: the frames are
    grey."""
    views = _views(root, points.mean(0))
    capture = Capture(root)
    meshes.write_ply(capture.scan, change(scan_of(model, truth)))
    if monkeypatch is not None:
        seen = {view.name: (view.project(points)[0], np.ones(468, bool)) for view in views}
        monkeypatch.setattr(landmarks, "find", lambda *_: landmarks.Landmarks(points.copy(), np.ones(468), 0.0, seen))
    return capture
