# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Registration against a known head: identity, pose, landmarks and scan are made, and must be found again."""

import numpy as np
from scipy.spatial import cKDTree

from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.geometry import meshes
from core.settings.settings import from_json
from core.stages import registration
from core.stages.registration import alignment, intersections, landmarks, nonrigid
from core.stages.registration.correspondence import Scan
from tests.fixtures.refused import refused
from tests.fixtures.scanned_head import grey_views, known, scan_of


def test_similarity_is_found_exactly():
    rng = np.random.default_rng(0)
    source = rng.normal(size=(20, 3))
    rotation = alignment._rotation(np.array([0.3, -1.1, 0.7]))
    found = alignment.similarity(source, 2.5 * source @ rotation.T + [1, 2, 3], rng.uniform(0.1, 1, 20))
    assert np.allclose(found.rotation, rotation) and np.isclose(found.scale, 2.5)
    assert np.allclose(found.translation, [1, 2, 3])


def test_landmarks_are_lifted_although_one_view_is_wrong(tmp_path):
    points, views = known().points, grey_views(tmp_path)
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


def test_a_known_head_is_recovered():
    model, truth, points, pose = known()
    corner = np.linalg.norm(model.mesh.uvs - [0.68, 0.42], axis=1).argmin()
    cheek = truth[model.mesh.faces[model.mesh.face_uvs == corner][0]]
    scan, trust = Scan(scan_of(truth, [cheek])), np.ones(468)
    follow, shaped, hold = registration.weights_of(model)

    first, coefficients = alignment.fit_landmarks(model, points, trust)
    assert abs(first.scale / pose.scale - 1) < 0.02
    near, coefficients = alignment.fit_scan(model, first, coefficients, points, trust, scan, shaped)
    start = near.apply(model.shape(coefficients))
    vertices = nonrigid.fit(model, start, scan, follow, nonrigid.LandmarkTargets(points, trust, hold), 6)

    error = np.linalg.norm(vertices - truth, axis=1)
    by_landmarks = np.linalg.norm(first.apply(model.mesh.vertices) - truth, axis=1)
    face, beside = follow > 0.5, np.linalg.norm(truth - cheek, axis=1)
    assert np.median(by_landmarks[face]) > 0.002, "the person differs from the neutral head"
    assert np.median(error[face]) < 0.0005 and np.percentile(error[face], 95) < 0.002
    assert np.median(cKDTree(scan.points).query(vertices[face & (beside > 0.015)])[0]) < 0.0005
    hole = beside < 0.010
    assert hole.sum() > 20 and error[hole].max() < 0.0015, "a hole in the scan is bridged"
    assert np.percentile(error[~face], 90) < 0.015, "ears, scalp and neck come along"
    assert not intersections.flipped(model.mesh.moved(truth), vertices).any()


def test_frames_without_a_face_are_a_problem(tmp_path):
    views = grey_views(tmp_path)
    meshes.write_ply(Capture(tmp_path).scan, scan_of(known().truth))
    refused(
        lambda: registration.run(Capture(tmp_path), from_json({}), Reporter("registration")),
        f"only 0 of the {len(views)}",
    )
