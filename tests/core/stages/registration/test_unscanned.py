# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head without a scan: a synthetic person from a few photographs that lie far apart, under known cameras."""

import json
from types import SimpleNamespace

import numpy as np
import pycolmap
import pytest
from scipy.spatial import cKDTree

from core.capture.capture import Capture
from core.capture.eyes_record import read_eyes
from core.capture.messages import Reporter
from core.geometry import meshes
from core.geometry.views import read_points, read_views
from core.imaging import images
from core.settings.settings import from_json
from core.stages import registration
from core.stages.registration import constraints, landmarks, quality, silhouettes, unscanned
from research.people import painted_head

AZIMUTHS = (-72, -36, 0, 36, 72)


def shot(root, azimuths=AZIMUTHS, points: int = 300, rise: float = 0.03) -> Capture:
    """A capture up to a scan that measured no surface: photographs of the person, each `rise` metres higher than the
    one before, their cameras, and points of the skin that matched, good to 0.3 mm."""
    capture, model, rng = Capture(root), pycolmap.Reconstruction(), np.random.default_rng(0)
    mesh = painted_head.person()[0].mesh
    normals = meshes.vertex_normals(mesh)
    views = [painted_head.place_camera(azimuth, rise * i, scale=1.5) for i, azimuth in enumerate(azimuths)]
    model.add_camera_with_trivial_rig(views[0].camera)
    x, y, z = mesh.vertices.T
    front = rng.choice(np.flatnonzero((y < 0.02) & (z > -0.11) & (z < 0.06)), points)
    places, members = mesh.vertices[front] + rng.normal(0, 3e-4, (points, 3)), [[] for _ in front]
    frames = []
    for number, view in enumerate(views, 1):
        frames.append({"name": f"{number:05d}.jpg", "sharpness": 1.0, "selected": True, "video_frame": number})
        images.write_srgb(capture.frames / frames[-1]["name"], painted_head.photograph(view))
        seen = np.flatnonzero(((view.centre - places) * normals[front]).sum(1) > 0)
        keypoints = view.project(places[seen])[0]
        image = pycolmap.Image(name=frames[-1]["name"], camera_id=1, image_id=number, keypoints=keypoints)
        for k, i in enumerate(seen):
            members[i].append(pycolmap.TrackElement(number, k))
        pose = np.concatenate([view.rotation, view.translation[:, None]], 1)
        model.add_image_with_trivial_frame(image, pycolmap.Rigid3d(pose))
    for place, elements in zip(places, members, strict=True):
        if len(elements) > 1:
            model.add_point3D(place, pycolmap.Track(elements), np.zeros(3, np.uint8))
    capture.cameras.mkdir()
    model.write(str(capture.cameras))
    capture.frames_json.write_text(json.dumps({"kind": "photographs", "frames": frames}))
    meshes.write_points(capture.scan, read_points(capture)[0])
    return capture


@pytest.fixture(scope="module")
def fitted(tmp_path_factory) -> tuple[Capture, Reporter]:
    capture, report = shot(tmp_path_factory.mktemp("fünf Fotos") / "face.wildcap"), Reporter("registration")
    registration.run(capture, from_json({}), report)
    return capture, report


def test_five_photographs_far_apart_make_a_head(fitted):
    capture, report = fitted
    truth, head = painted_head.person()[0].mesh, meshes.read_obj(capture.head)
    face = truth.vertices[registration.weights_of(registration.load_model())[0] > 0.5]
    distance, index = cKDTree(head.vertices).query(face)
    plane = np.abs(((face - head.vertices[index]) * meshes.vertex_normals(head)[index]).sum(1))
    off_mm = 1e3 * np.where(distance < 0.004, plane, distance)
    assert np.median(off_mm) < 1.0 and np.percentile(off_mm, 90) < 3.0
    assert report.figures["views_apart"] == 5 and not report.findings
    assert min(report.figures[f"constraints_by_{name}"] for name in ("landmarks", "points", "outlines")) > 50
    assert report.figures["flipped_triangles"] < 5 and report.figures["intersecting_triangles"] == 0
    assert "199" in json.loads(capture.landmarks.read_text())["points"]


def test_one_side_makes_a_draft_with_open_eyes_and_the_artists_chin(fitted, tmp_path, monkeypatch):
    """Nothing can be lifted from views a degree apart: the straightest alone tells where the eyes are."""
    monkeypatch.setattr(registration.eyes, "opening", lambda seen: 0.35)
    monkeypatch.setattr(unscanned, "STEPS", 3)
    capture, report = shot(tmp_path / "selfies.wildcap", (-1, 0, 1), points=0, rise=0.0), Reporter("registration")
    chin = np.array(json.loads(fitted[0].landmarks.read_text())["points"]["199"]) + [0, 0, -0.006]
    capture.landmarks_artist.write_text(json.dumps({"points": {"199": chin.tolist()}}))
    registration.run(capture, from_json({}), report)
    left, right = read_eyes(capture)
    assert capture.head_open.is_file() and capture.picture("registration", "eyes").is_file()
    assert left.centre[0] > 0.02 and right.centre[0] < -0.02
    assert "draft" in report.findings[0]["problem"] and report.figures["views_apart"] == 1
    assert report.figures["landmarks_put_by_hand"] == 1 and report.figures["put_landmark_residual_mm"] < 2


def test_of_many_views_32_spread_over_all_are_asked(monkeypatch):
    views, asked = [painted_head.place_camera(azimuth) for azimuth in np.linspace(-70, 70, 61)], []

    def note(capture, chosen, subject, report):
        asked.extend(chosen)
        raise InterruptedError

    monkeypatch.setattr(registration, "_shown", note)
    with pytest.raises(InterruptedError):
        registration._by_views(None, None, views, SimpleNamespace(model=None, landmarks=None), Reporter("registration"))
    assert len(asked) == 32 and asked[0] is views[0] and asked[-1] is views[-1]


def test_an_outline_is_found_to_a_fraction_of_a_millimetre(fitted):
    """The true head should not move by its own pictures, and a shifted one by its shift."""
    truth = painted_head.person()[0].mesh
    follow, edges = registration.weights_of(registration.load_model())[0], silhouettes.edges_of(truth)
    view = read_views(fitted[0])[0]
    outline = silhouettes.prepare(view, truth, follow)
    rest = silhouettes.compare(outline, truth, edges, follow, 0.006)
    assert len(rest) > 15 and abs(np.median(rest.distance)) < 6e-4
    towards = np.cross(view.axis, [0, 0, 1])
    moved = silhouettes.compare(outline, truth.moved(truth.vertices + 0.003 * towards), edges, follow, 0.006)
    assert np.median(np.abs(moved.distance + 0.003 * (moved.direction @ towards))) < 1e-3


def test_where_a_scan_ends_the_outlines_bring_the_jaw_in_and_what_lies_on_the_scan_stays(fitted):
    """The true head with a jaw that is 5 mm too narrow beside a scan of the middle of the face."""
    capture, report = fitted[0], Reporter("registration")
    model, truth, views = registration.load_model(), painted_head.person()[0].mesh, read_views(capture)
    subject = registration._subject(landmarks.with_artists(landmarks.find(views, report, 100), {}), report)
    shown = registration._shown(capture, views, subject, report)
    beside = np.clip((np.abs(truth.vertices[:, 0]) - 0.035) / 0.025, 0, 1)
    narrow = truth.vertices - 0.005 * beside[:, None] * np.sign(truth.vertices[:, :1]) * [1, 0, 0]
    found = unscanned.beyond_scan(model, narrow, beside == 0, shown, lambda share, text: None)
    normals = meshes.vertex_normals(truth)
    before, after = (1e3 * np.abs(((vertices - truth.vertices) * normals).sum(1)) for vertices in (narrow, found))
    jaw = (registration.weights_of(model)[0] > 0.5) & (beside == 1)
    assert jaw.sum() > 100 and np.median(after[jaw]) < 0.6 * np.median(before[jaw])
    stayed = after[beside == 0]
    assert np.percentile(stayed, 95) < 0.15 and stayed.max() < 0.6, "what was measured stays; its rim, nearly"


def test_points_behind_the_skin_or_of_its_far_side_do_not_pull():
    mesh = meshes.Mesh(np.array([[0, 0, 0], [0.002, 0, 0], [0, 0, 0.002]]), np.array([[0, 1, 2]]))
    follow, normal = np.ones(3), np.array([0.0, -1, 0])
    points = np.array([[0, -0.001, 0], [0, -0.02, 0], [0, -0.001, 0]])
    found = constraints.from_points(mesh, follow, points, np.array([normal, normal, -normal]), 0.004)
    assert len(found) == 1 and found.distance[0] == pytest.approx(0.001)


@pytest.mark.parametrize(
    ("azimuths", "count"), [((0, 30, 60, 90), 4), ((0, 10, 20), 1), ((-20, 0, 20), 2), ((-13, 0, 13, 40), 3)]
)
def test_views_are_counted_by_how_far_they_lie_apart(azimuths, count):
    head, report = painted_head.person()[0].mesh, Reporter("registration")
    middle = head.vertices.mean(0)
    views = [painted_head.place_camera(azimuth, middle[2], 5.0, tuple(middle)) for azimuth in azimuths]
    assert quality.views_apart(views, head) == count
    quality.tell_draft(report, views, head)
    assert bool(report.findings) == (count < 3)
