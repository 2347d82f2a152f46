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
from core.stages.registration import constraints, quality, silhouettes, unscanned
from research.people import painted_head

AZIMUTHS = (-72, -36, 0, 36, 72)
SCALE = 1.5


def shot(root, azimuths=AZIMUTHS, points: int = 300, rise: float = 0.03) -> Capture:
    """A capture up to a scan that measured no surface: photographs of the person, each `rise` metres higher than the
    one before, their cameras, and points of the skin that matched, good to 0.3 mm."""
    capture, model, rng = Capture(root), pycolmap.Reconstruction(), np.random.default_rng(0)
    capture.frames.mkdir(parents=True)
    mesh = painted_head.person()[0].mesh
    normals = meshes.vertex_normals(mesh)
    views = [painted_head.place_camera(azimuth, rise * i, scale=SCALE) for i, azimuth in enumerate(azimuths)]
    names = [f"{i:05d}.jpg" for i in range(len(views))]
    params = views[0].camera.params
    pinhole = params if len(params) == 4 else [*params[:1], *params[:3]]
    model.add_camera_with_trivial_rig(
        pycolmap.Camera(camera_id=1, model="PINHOLE", width=views[0].width, height=views[0].height, params=pinhole)
    )
    front = rng.choice(
        np.flatnonzero((mesh.vertices[:, 1] < 0.02) & (mesh.vertices[:, 2] > -0.11) & (mesh.vertices[:, 2] < 0.06)),
        points,
    )
    places, members = mesh.vertices[front] + rng.normal(0, 3e-4, (points, 3)), [[] for _ in front]
    for number, (name, view) in enumerate(zip(names, views, strict=True), 1):
        images.write_srgb(capture.frames / name, painted_head.photograph(view))
        seen = np.flatnonzero(((view.centre - places) * normals[front]).sum(1) > 0)
        image = pycolmap.Image(name=name, camera_id=1, image_id=number, keypoints=view.project(places[seen])[0])
        for k, i in enumerate(seen):
            members[i].append(pycolmap.TrackElement(number, k))
        pose = np.concatenate([view.rotation, view.translation[:, None]], 1)
        model.add_image_with_trivial_frame(image, pycolmap.Rigid3d(pose))
    for place, elements in zip(places, members, strict=True):
        if len(elements) > 1:
            model.add_point3D(place, pycolmap.Track(elements), np.zeros(3, np.uint8))
    capture.cameras.mkdir()
    model.write(str(capture.cameras))
    frames = [{"name": name, "sharpness": 1.0, "selected": True, "video_frame": i} for i, name in enumerate(names)]
    capture.frames_json.write_text(json.dumps({"kind": "photographs", "frames": frames}))
    meshes.write_points(capture.scan, read_points(capture)[0])
    return capture


def off_mm(capture: Capture) -> np.ndarray:
    """Distances of the person's face to the head, millimetres."""
    truth, head = painted_head.person()[0].mesh, meshes.read_obj(capture.head)
    follow = registration.weights_of(registration.load_model())[0] > 0.5
    distance, index = cKDTree(head.vertices).query(truth.vertices[follow])
    plane = np.abs(((truth.vertices[follow] - head.vertices[index]) * meshes.vertex_normals(head)[index]).sum(1))
    return 1e3 * np.where(distance < 0.004, plane, distance)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory) -> tuple[Capture, Reporter]:
    capture, report = shot(tmp_path_factory.mktemp("fünf Fotos") / "face.wildcap"), Reporter("registration")
    registration.run(capture, from_json({}), report)
    return capture, report


def test_five_photographs_far_apart_make_a_head(fitted):
    capture, report = fitted
    off = off_mm(capture)
    assert np.median(off) < 1.0 and np.percentile(off, 90) < 3.0
    assert report.figures["views_apart"] == 5 and not report.findings
    assert min(report.figures[f"constraints_by_{name}"] for name in ("landmarks", "points", "outlines")) > 50
    assert report.figures["flipped_triangles"] < 5 and report.figures["intersecting_triangles"] == 0
    assert "199" in json.loads(capture.landmarks.read_text())["points"]


def test_two_sides_make_a_draft_that_says_so(tmp_path):
    capture, report = shot(tmp_path / "draft.wildcap", (-12, 0, 12), points=0), Reporter("registration")
    registration.run(capture, from_json({}), report)
    assert capture.head.is_file() and report.figures["views_apart"] < 3
    assert (
        report.findings[0]["problem"].startswith("This head is a draft")
        and "from each side" in report.findings[0]["remedy"]
    )


def test_open_eyes_from_one_side_make_a_draft_with_eyeballs(tmp_path, monkeypatch):
    """Nothing can be lifted from views a degree apart: the straightest alone tells where the eyes are."""
    monkeypatch.setattr(registration.eyes, "opening", lambda seen: 0.35)
    capture, report = shot(tmp_path / "selfies.wildcap", (-1, 0, 1), points=0, rise=0.0), Reporter("registration")
    registration.run(capture, from_json({}), report)
    left, right = read_eyes(capture)
    assert capture.head_open.is_file() and capture.picture("registration", "eyes").is_file()
    assert left.centre[0] > 0.02 and right.centre[0] < -0.02
    assert report.findings[0]["problem"].startswith("This head is a draft")


def test_of_many_views_32_spread_over_all_are_asked(monkeypatch):
    views, asked = [painted_head.place_camera(azimuth) for azimuth in np.linspace(-70, 70, 61)], []

    def note(capture, chosen, subject, report):
        asked.extend(chosen)
        raise InterruptedError

    monkeypatch.setattr(registration, "_shown", note)
    with pytest.raises(InterruptedError):
        registration._by_views(None, None, views, SimpleNamespace(model=None, landmarks=None), Reporter("registration"))
    assert len(asked) == 32 and asked[0] is views[0] and asked[-1] is views[-1]


def test_landmarks_that_the_artist_puts_win(fitted, tmp_path):
    capture, _ = fitted
    chin = np.array(json.loads(capture.landmarks.read_text())["points"]["199"]) + [0, 0, -0.006]
    moved = Capture(tmp_path / "moved.wildcap")
    for folder in ("frames", "cameras"):
        (moved.root / folder).mkdir(parents=True)
        for path in (capture.root / folder).iterdir():
            (moved.root / folder / path.name).write_bytes(path.read_bytes())
    moved.scan.write_bytes(capture.scan.read_bytes())
    moved.landmarks_artist.write_text(json.dumps({"points": {"199": chin.tolist()}}))
    report = Reporter("registration")
    registration.run(moved, from_json({}), report)
    assert report.figures["landmarks_put_by_hand"] == 1 and report.figures["put_landmark_residual_mm"] < 2


def test_an_outline_is_found_to_a_fraction_of_a_millimetre(fitted):
    """The true head against its own pictures: what its outline should move by is nothing; and of one that is moved,
    what it was moved by."""
    capture, _ = fitted
    truth, model = painted_head.person()[0].mesh, registration.load_model()
    follow, edges = registration.weights_of(model)[0], silhouettes.edges_of(truth)
    view = read_views(capture)[0]
    outline = silhouettes.prepare(view, truth, follow)
    rest = silhouettes.compare(outline, truth, edges, follow, 0.006)
    assert len(rest) > 15 and abs(np.median(rest.distance)) < 6e-4
    towards = np.cross(view.axis, [0, 0, 1])
    moved = silhouettes.compare(outline, truth.moved(truth.vertices + 0.003 * towards), edges, follow, 0.006)
    expected = -0.003 * (moved.direction @ towards)
    assert np.median(np.abs(moved.distance - expected)) < 1e-3


def test_where_a_scan_ends_the_outlines_bring_the_jaw_in_and_what_lies_on_the_scan_stays(fitted):
    """The true head with a jaw that is 5 mm too narrow beside a scan of the middle of the face."""
    capture, _ = fitted
    model, truth = registration.load_model(), painted_head.person()[0].mesh
    views, report = read_views(capture), Reporter("registration")
    marks = registration.landmarks.with_artists(registration.landmarks.find(views, report, 100), {})
    subject = registration._subject(marks, report)
    aside = np.abs(truth.vertices[:, 0])
    beside = np.clip((aside - 0.035) / 0.025, 0, 1)
    narrow = truth.vertices - 0.005 * beside[:, None] * np.sign(truth.vertices[:, :1]) * [1, 0, 0]
    shown = registration._shown(capture, views, subject, report)
    found = unscanned.beyond_scan(model, narrow, beside == 0, shown, report, 0, 100)
    normals = meshes.vertex_normals(truth)
    off = {
        name: 1e3 * np.abs(((vertices - truth.vertices) * normals).sum(1))
        for name, vertices in (("before", narrow), ("after", found))
    }
    jaw = (registration.weights_of(model)[0] > 0.5) & (beside == 1)
    assert jaw.sum() > 100 and np.median(off["after"][jaw]) < 0.6 * np.median(off["before"][jaw])
    stayed = off["after"][beside == 0]
    whole = unscanned.beyond_scan(model, truth.vertices, np.ones(len(aside), bool), shown, report, 0, 100)
    assert np.abs(whole - truth.vertices).max() < 1e-4, "a scan of all of it leaves nothing to do"
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
    head = painted_head.person()[0].mesh
    middle = head.vertices.mean(0)
    views = [painted_head.place_camera(azimuth, middle[2], 5.0, tuple(middle)) for azimuth in azimuths]
    assert quality.views_apart(views, head) == count
