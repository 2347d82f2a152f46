# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Registration against a known head: identity, pose, landmarks and scan are made, and must be found again; a landmark
placed by hand wins; cuts and folds are counted by Blender's own triangle test and mended."""

import json

import numpy as np
import pytest
from scipy.spatial import cKDTree

from core.capture import artist_landmarks
from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.face import template
from core.geometry import meshes
from core.geometry.views import read_views
from core.settings.settings import Settings, from_json
from core.stages import registration
from core.stages.registration import alignment, eyes, intersections, landmarks, nonrigid, quality
from core.stages.registration.correspondence import Scan
from research.people.identities import subject_mesh
from tests.fixtures.refused import refused
from tests.fixtures.scanned_head import grey_views, known, scan_of, scanned


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


MOUTH_CORNER = 61


def test_a_moved_landmark_takes_the_surface_along(tmp_path, monkeypatch):
    model, _, points, _ = known()
    capture, report = scanned(tmp_path / "c", monkeypatch), Reporter("registration")
    capture.json.write_text('{"format": 2, "source": "", "stages": {}}')
    wish = points[MOUTH_CORNER] + [-0.005, 0, 0.003]
    artist_landmarks.put(capture, {MOUTH_CORNER: wish})
    registration.run(capture, from_json({"registration": {"iterations": 5}}), report)
    at = model.at_landmarks(meshes.read_obj(capture.head).vertices)
    assert np.linalg.norm(at[MOUTH_CORNER] - wish) < 0.0007, "not where the frames and the scan have it"
    assert report.figures["landmarks_put_by_hand"] == 1 and report.figures["put_landmark_residual_mm"] < 0.7
    far = np.linalg.norm(points - points[MOUTH_CORNER], axis=1) > 0.05
    assert np.median(np.linalg.norm(at - points, axis=1)[far]) < 0.001, "the rest of the face stays"
    assert report.figures["flipped_triangles"] == 0
    stored = json.loads(capture.landmarks.read_text())["points"][str(MOUTH_CORNER)]
    assert np.linalg.norm(np.array(stored) - wish) < 1e-5
    capture.landmarks_artist.write_text("not json")
    refused(lambda: registration.run(capture, Settings(), Reporter("registration")), "landmarks_artist")


def blenders(vertices, faces) -> set:
    """Pairs of triangles that cut each other, as Blender's 3D Print Toolbox counts them."""
    pytest.importorskip("bpy")
    from mathutils.bvhtree import BVHTree

    tree = BVHTree.FromPolygons(vertices.tolist(), faces.tolist(), epsilon=0.0)
    return {(a, b) for a, b in tree.overlap(tree) if a < b}


def test_two_triangles_through_each_other_are_found():
    flat, through = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0.2, 0.2, -1], [0.3, 0.2, 1], [0.2, 0.3, 1]]
    vertices, faces = np.array([*flat, *through, [2, 0, 0], [2, 1, 0.0]]), np.array([[0, 1, 2], [3, 4, 5], [1, 6, 7]])
    assert intersections.intersecting(vertices, faces).tolist() == [[0, 1]]
    assert len(intersections.intersecting(vertices, faces[[0, 2]])) == 0


@pytest.mark.parametrize("seed", [1, 70])
def test_a_head_that_cuts_itself_is_mended(seed):
    """These synthetic people are caricatures whose lips and ears pass through themselves."""
    rest, head = template.load(), subject_mesh(seed)
    ours = {tuple(pair) for pair in intersections.intersecting(head.vertices, head.faces).tolist()}
    theirs = blenders(head.vertices, head.faces)
    assert len(theirs) > 20 and len(ours & theirs) > 0.95 * len(theirs)
    pose = alignment.similarity(rest.vertices, head.vertices, np.ones(len(rest.vertices)))
    mended = intersections.mend(rest.moved(pose.apply(rest.vertices)), head.vertices)
    moved = np.linalg.norm(mended - head.vertices, axis=1)
    assert blenders(mended, head.faces) == set()
    assert not intersections.flipped(rest, mended).any()
    assert (moved > 0).mean() < 0.02 and moved.max() < 0.004, "all but the spot stays where it is"


@pytest.fixture(scope="module")
def lids():
    return registration._per_vertex(known().model.mesh, "eyes")


@pytest.fixture(scope="module")
def registered(lids, tmp_path_factory):
    """A capture with open eyes after the stage, and its report."""
    changed, marks = _eyes_opened(known().truth, known().points, lids)
    report = Reporter("registration")
    with pytest.MonkeyPatch.context() as patched:
        capture = scanned(tmp_path_factory.mktemp("Café") / "Müller.wildcap", patched, changed, marks, 0.35)
        patched.setattr(landmarks, "onto_surface", lambda found, *_: found)
        registration.run(capture, from_json({"registration": {"iterations": 5}}), report)
    return capture, report


def test_open_eyes_do_not_pull_the_lids_in(registered, lids):
    capture, report = registered
    head = meshes.read_obj(capture.head)
    assert np.percentile(np.linalg.norm(head.vertices - known().truth, axis=1)[lids > 0.9], 90) < 0.0004
    assert report.figures["flipped_triangles"] == 0 and report.figures["eye_opening"] == 0.35
    assert blenders(head.vertices, head.faces) == set()


def test_the_stage_writes_a_head_of_the_frozen_topology(registered):
    capture, report = registered
    model, truth, points, _ = known()
    head = meshes.read_obj(capture.head)
    assert template.is_built_in(head) and report.figures["head_to_scan_median_mm"] < 0.5
    follow = registration.weights_of(model)[0] > 0.5
    assert np.median(np.linalg.norm(head.vertices - truth, axis=1)[follow]) < 0.001
    stored = json.loads(capture.landmarks.read_text())
    assert np.linalg.norm(np.array(stored["points"]["152"]) - points[152]) < 0.001
    assert set(stored["images"]) == {view.name for view in read_views(capture)}
    assert capture.picture("registration", "wireframe").is_file()


def test_eyes_are_judged_from_the_front():
    closed_but_for_the_side = [(50.0, (0.5, 0.4)), (3.0, (0.1, 0.2)), (-10.0, (0.25, 0.09)), (-48.0, (0.4, 0.4))]
    assert not eyes.are_open(eyes.opening(closed_but_for_the_side))
    assert eyes.are_open(eyes.opening([(0.0, (0.33, 0.34)), (12.0, (0.30, 0.36)), (-15.0, (0.29, 0.31))]))
    assert not eyes.are_open(eyes.opening([(60.0, (0.4, 0.4))])), "nobody looked: as the template"


def test_the_missing_side_is_named():
    model, truth, _, _ = known()
    follow, whole = registration.weights_of(model)[0], scan_of(truth)
    half = whole.faces[whole.vertices[whole.faces].mean(1)[:, 0] > truth[follow > 0.5, 0].mean() - 0.005]
    scan, report, head = Scan(meshes.Mesh(whole.vertices, half)), Reporter("registration"), model.mesh.moved(truth)
    distances = scan.distances(truth[follow > 0.5], meshes.vertex_normals(head)[follow > 0.5])
    quality.judge(report, head, scan, distances, follow)
    text = " ".join(finding["problem"] for finding in report.findings)
    assert "right side" in text and "left side" not in text
    for off, words in ((distances[:0], "only 0 %"), (distances + 0.005, "5 mm")):
        refused(lambda off=off: quality.judge(report, head, scan, off, follow), words)


def _eyes_opened(truth, points, lids):
    """The head's vertices with 4 mm deep eyes between the lids, and the marks of opened lids."""
    changed, marks = truth.copy(), points.copy()
    for inner, outer in ((133, 33), (362, 263)):
        middle = (points[inner] + points[outer]) / 2
        axis = points[outer] - points[inner]
        across = (truth - middle) @ (axis / np.linalg.norm(axis)) / 0.013
        near = (lids > 0.3) & (np.linalg.norm(truth - middle, axis=1) < 0.02)
        changed[(across**2 + ((truth - middle)[:, 2] / 0.007) ** 2 < 1) & near, 1] += 0.004
    rims = np.array(eyes.LID_MARKS)
    middles = np.where(
        (marks[rims, 0] < points[[33, 263], 0].mean())[:, None], points[[33, 133]].mean(0), points[[263, 362]].mean(0)
    )
    marks[rims, 2] += np.where(marks[rims, 2] > middles[:, 2], 0.005, -0.003)
    return changed, marks
