# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Eyes that were open while filming: marks lifted to the lids' edges, eyeballs placed by them, the head opened to meet
them, and what that hides."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pycolmap
import pytest

from core.capture.capture import Capture
from core.capture.eyes_record import Eyeball, read_eyes, write_eyes
from core.capture.messages import Reporter
from core.face import eye_reader, faces, lids, template
from core.face.faces import Eye
from core.face.head import read_filmed_head, read_head
from core.geometry import meshes, raster
from core.geometry.views import View
from core.stages.registration import eye_looks, eyeballs, landmarks, lid_marks
from research.people.lifelike import shape
from tests.fixtures.refused import refused

SEED, IRIS_M = 4, 0.0059
QUIET = Reporter("registration", emit=lambda message: None)
SLIPPED_M = np.array([0.0008, -0.0012, 0.0006])
"""How far off the head lies that the eyes are fitted to: what a registration leaves."""


@pytest.fixture(scope="module")
def person():
    head = shape.person_mesh(SEED)
    return head, lids.open_lids(head, 0.8, np.array([6.0, -3.0]))


@pytest.fixture(scope="module")
def fitted(person):
    head, opened = person
    start = replace(head, vertices=head.vertices + SLIPPED_M)
    return start, eyeballs.fit(start, tuple(rims_of(opened, side) for side in (0, 1)), 0.35)


def rims_of(opened: lids.OpenHead, side: int) -> lid_marks.LidMarks:
    """Nine marks on each edge, from the outer corner to the inner one, and the disc within the iris' edge."""
    edges = lids.edges(opened.skin.vertices, side)
    chosen = [edge[np.linspace(0, len(edge) - 1, 9).round().astype(int)] for edge in edges]
    return lid_marks.LidMarks(*chosen, disc_of(opened.balls[side]), IRIS_M, 9)


def disc_of(ball: lids.PosedEyeball) -> np.ndarray:
    """The middle [3] of the ring on a ball that is the iris' edge."""
    return ball.centre + np.sqrt(ball.radius**2 - IRIS_M**2) * ball.gaze


def view_from(degrees: float, distance: float = 0.5) -> View:
    """A camera 1000 pixels wide that looks at the middle between the eyes, from an angle to the head's left."""
    turn = np.radians(degrees)
    back = np.array([np.sin(turn), -np.cos(turn), 0.0])
    rotation = np.stack([np.cross(-back, [0, 0, 1.0]), [0, 0, -1.0], -back])
    camera = pycolmap.Camera(model="PINHOLE", width=1000, height=1000, params=[1500, 1500, 500, 500])
    return View(f"{degrees}.jpg", None, camera, rotation, -rotation @ (distance * back), True)


def seen_share(opened: lids.OpenHead, side: int, view: View, slip: float = 0.0) -> eye_looks.EyeLook:
    """What a perfect reader sees of an eye, all of it shifted by `slip` metres to the picture's right. The iris is
    drawn on a mesh whose cornea bulges: its edge lies half a millimetre before the ring that a real one is."""
    ball, over = opened.balls[side], 3
    caster = raster.RayCaster(meshes.joined([opened.skin, ball.mesh]))
    move = eye_reader.to_eye_crop(view.project(opened.skin.vertices[list(lids.corners()[side])])[0], side == 0)
    y, x = (np.mgrid[0 : eye_reader.SIDE_PX * over, 0 : eye_reader.SIDE_PX * over] + 0.5) / over
    pixels = (np.stack([x.ravel(), y.ravel()], 1) - move[:, 2]) @ np.linalg.inv(move[:, :2]).T
    origins = np.repeat((view.centre - slip * view.rotation[0])[None], len(pixels), 0)
    face, bary, _ = caster.first_hits(origins, view.rays(pixels))
    on_ball = face >= len(opened.skin.faces)
    hit = raster.interpolate(caster.mesh.vertices, caster.mesh.faces, np.maximum(face, 0), bary)
    inside = on_ball & (np.linalg.norm(np.cross(hit - ball.centre, ball.gaze), axis=-1) < IRIS_M)
    white, iris = (
        share.reshape(eye_reader.SIDE_PX, over, eye_reader.SIDE_PX, over).mean((1, 3), dtype=np.float32)
        for share in (on_ball, inside)
    )
    return eye_looks.EyeLook(view, eye_reader.EyeShares(white, iris, move))


def seen_eye(rims: lid_marks.LidMarks, view: View) -> Eye:
    upper, lower, iris = (view.project(points)[0] for points in (rims.upper, rims.lower, rims.iris[None]))
    depth = view.project(rims.iris[None])[1][0]
    return Eye(upper, lower, iris[0], rims.iris_radius * 1500 / depth)


def off_curve(points: np.ndarray, curve: np.ndarray) -> np.ndarray:
    fine = np.concatenate([a + (b - a) * np.linspace(0, 1, 20)[:, None] for a, b in pairwise(curve)])
    return np.linalg.norm(points[:, None] - fine[None], axis=2).min(1)


@pytest.fixture(scope="module")
def marked(person):
    """The left eye as four views show it to a perfect reader, marked from a head that lies beside it."""
    head, opened = person
    looks = [seen_share(opened, 0, view_from(degrees)) for degrees in (-20, -5, 10, 25)]
    return lid_marks.mark(looks, begun_beside(head), 0, QUIET)


def begun_beside(head) -> lids.OpenHead:
    return lids.open_lids(replace(head, vertices=head.vertices + SLIPPED_M), 1.0, np.zeros(2))


def off_edges(found: lid_marks.LidMarks, opened: lids.OpenHead) -> np.ndarray:
    pairs = zip((found.upper, found.lower), lids.edges(opened.skin.vertices, 0), strict=True)
    return np.concatenate([off_curve(marks[1:-1], edge) for marks, edge in pairs])


def test_the_edges_and_the_iris_that_all_views_show_are_found(person, marked):
    opened = person[1]
    ball = opened.balls[0]
    off = off_edges(marked, opened)
    assert off.mean() < 0.0007 and off.max() < 0.0015
    outer, inner = opened.skin.vertices[list(lids.corners()[0])]
    assert np.linalg.norm(marked.upper[0] - outer) < 0.0015 and np.linalg.norm(marked.upper[-1] - inner) < 0.0015
    across = (marked.iris - disc_of(ball)) @ (np.eye(3) - np.outer(ball.gaze, ball.gaze))
    assert np.linalg.norm(across) < 0.0003 and np.linalg.norm(marked.iris - disc_of(ball)) < 0.001
    assert marked.views == 4 and marked.iris_radius == pytest.approx(IRIS_M, rel=0.03)


def test_a_blink_that_slips_through_and_one_frame_that_is_off_hardly_count(person, marked):
    head, opened = person
    looks = [seen_share(opened, 0, view_from(degrees), 0.003 * (degrees == 0)) for degrees in (-20, -10, 0, 10, 25)]
    assert off_edges(lid_marks.mark(looks, begun_beside(head), 0, QUIET), opened).mean() < 0.0008
    looks[2] = replace(looks[2], shares=replace(looks[2].shares, ball=np.zeros_like(looks[2].shares.ball)))
    assert off_edges(lid_marks.mark(looks, begun_beside(head), 0, QUIET), opened).mean() < 0.0007


def test_an_eye_that_no_view_shows_is_not_marked(person):
    head, opened = person
    look = seen_share(opened, 0, view_from(0))
    nothing = replace(look, shares=replace(look.shares, ball=np.zeros_like(look.shares.ball)))
    for looks in ([], [nothing]):
        assert lid_marks.mark(looks, begun_beside(head), 0, QUIET) is None


def test_an_eye_is_not_read_beyond_the_nose_nor_in_a_blink(person):
    rims = rims_of(person[1], 0)
    eye = seen_eye(rims, view_from(0))
    shut = replace(eye, upper=eye.lower + 0.3 * (eye.upper - eye.lower))
    seen = [(0, eye), (-40, eye), (40, eye), (5, shut), (-60, eye)]
    # yaw is positive where the head turns to the picture's right, and hides its left eye
    assert eye_looks.usable(seen, 0) == [0, 1]
    assert eye_looks.usable(seen, 1) == [0, 2]


def test_the_eyes_of_another_face_are_not_read(person, monkeypatch):
    """Four views of one person, and one in which another face, larger and with wide eyes, was found."""
    head, opened = person
    views = [replace(view_from(degrees), name=f"{i}.jpg") for i, degrees in enumerate((-20, -8, 0, 8, 20))]
    marks = template.landmark_points(head)
    found = []
    for i, view in enumerate(views):
        pixels = view.project(marks)[0]
        pair = [seen_eye(rims_of(opened, side), view) for side in (1, 0)]
        if i == 2:
            pixels = 1.5 * pixels - [400, 100]
            pair = [replace(eye, lower=eye.upper + 1.2 * (eye.lower - eye.upper)) for eye in pair]
        face = faces.Face((0, 0, 1000, 1000), np.concatenate([pixels, np.zeros((468, 1))], 1), 0.9)
        found.append((face, pair))
    detected, paired = iter(face for face, _ in found), iter(pair for _, pair in found)
    monkeypatch.setattr(type(views[0]), "read", lambda view: np.zeros((1000, 1000, 3), np.float32))
    monkeypatch.setattr(landmarks.faces, "detect", lambda srgb: next(detected))
    monkeypatch.setattr(landmarks.faces, "find_eyes", lambda srgb, face: next(paired))
    marked = landmarks.find(views, QUIET, 100.0)
    own = [min(eye.opening for eye in pair) for i, (_, pair) in enumerate(found) if i != 2]
    assert marked.opening == pytest.approx(np.median(own))
    nothing = eye_reader.EyeShares(*np.zeros((2, 96, 96)), np.zeros((2, 3)))
    monkeypatch.setattr(eye_looks, "read_eye", lambda srgb, corners, left: nothing)
    for looks in eye_looks.look(views, marked, QUIET):
        assert [each.view.name for each in looks] == ["0.jpg", "1.jpg", "3.jpg", "4.jpg"]


@pytest.mark.parametrize("degrees", [0, 30])
def test_what_a_single_view_shows_is_lifted_as_deep_as_it_is_large(person, degrees):
    """The same picture in a world of 50 mm between the pupils and in one of 63."""
    pixels = view_from(degrees).project(template.landmark_points(person[0]))[0]
    usual, small = (landmarks.lift_alone(view_from(degrees, d), pixels).points for d in (0.5, 0.5 * 50 / 63))
    assert np.abs(63 / 50 * small - usual).max() < 0.0005
    assert np.linalg.norm(usual - template.landmark_points(person[0]), axis=1).mean() < 0.005


def test_lids_meet_the_edges_that_were_seen_and_balls_lie_behind_them(person, fitted):
    _, opened = person
    start, found = fitted
    for side in (0, 1):
        true, ball = opened.balls[side], found.opened.balls[side]
        before = np.linalg.norm(lids.carry_ball(start, side)[0] - true.centre)
        assert np.linalg.norm(ball.centre - true.centre) < min(0.0015, before)
        assert abs(ball.radius - true.radius) < 0.001
        assert np.degrees(np.arccos(np.clip(ball.gaze @ true.gaze, -1, 1))) < 5
        for rim, edge in zip(found.opened.rims[side], lids.edges(opened.skin.vertices, side), strict=True):
            points = found.opened.skin.vertices[rim]
            off = off_curve(points, edge)
            assert off.mean() < 0.0003 and off.max() < 0.001
            assert (np.linalg.norm(points - ball.centre, axis=1) - ball.radius).min() > 0.9 * lids.CLEAR_M


def test_closed_lids_clear_the_balls_and_the_rest_of_the_head_stays(fitted):
    start, found = fitted
    moved = np.linalg.norm(found.head.vertices - start.vertices, axis=1)
    far = np.min([np.linalg.norm(start.vertices - ball.centre, axis=1) for ball in found.opened.balls], axis=0) > 0.06
    assert moved[far].max() < 1e-5 and moved.max() < 0.004
    for ball in found.opened.balls:
        v = found.head.vertices - ball.centre
        near = (np.linalg.norm(v, axis=1) < 1.2 * ball.radius) & (v[:, 1] < -0.5 * ball.radius)
        assert np.linalg.norm(v[near], axis=1).min() > ball.radius
    assert lids.belongs_to(found.opened.skin, found.head)


def test_an_eye_that_no_two_frames_show_is_open_as_wide_as_it_looks(person):
    head, opened = person
    found = eyeballs.fit(head, (rims_of(opened, 0), None), 0.33)
    upper, lower = (found.opened.skin.vertices[rim] for rim in found.opened.rims[1])
    outer, inner = (found.opened.skin.vertices[corner] for corner in lids.corners()[1])
    middle = np.sort(np.linalg.norm(upper - lower, axis=1))[-9:].mean() / np.linalg.norm(outer - inner)
    assert middle == pytest.approx(0.33, abs=0.02)
    assert found.measured == (9, 0) and np.isnan(found.iris_radius[1])
    assert found.records()[1].iris_radius == 0


@pytest.fixture
def capture(tmp_path, fitted):
    capture = Capture(tmp_path / "face.wildcap")
    capture.claim()
    _, found = fitted
    meshes.write_obj(capture.head, found.head)
    meshes.write_obj(capture.head_open, found.opened.skin)
    write_eyes(capture, *found.records())
    return capture


def test_no_iris_is_seen_on_a_lid(capture, fitted):
    """From the front, rays to the irises meet the closed head's lids, and the filmed head's eyeballs, which are none of
    its triangles."""
    closed, filmed = read_head(capture), read_filmed_head(capture)
    assert len(filmed.mesh.faces) == len(closed.mesh.faces)
    eye = np.array([0, -0.6, 0.0])
    towards = meshes.unit(np.stack([ball.centre + ball.radius * ball.gaze - eye for ball in fitted[1].opened.balls]))
    for head in (closed, filmed):
        face, _, _ = head.caster.first_hits(np.repeat(eye[None], 2, 0), towards)
        assert ((face < len(head.mesh.faces)) == (head is closed)).all()


def test_another_head_put_beside_open_eyes_is_taken_as_it_is(capture):
    other = shape.person_mesh(SEED + 1)
    meshes.write_obj(capture.head, other)
    assert np.allclose(read_filmed_head(capture).mesh.vertices, other.vertices, atol=1e-5)


def test_the_record_of_the_eyes_comes_back_and_a_damaged_one_is_refused(capture):
    left = Eyeball((0.03, 0.01, 0.0), 0.0155, (0.0, -1.0, 0.0), 0.9, 0.0058, 7)
    pair = left, replace(left, centre=(-0.03, 0.01, 0.0), views=0)
    write_eyes(capture, *pair)
    assert read_eyes(capture) == pair
    record = json.loads(capture.eyes.read_text())
    damage = [("radius", 0), ("gaze", [0, 0, 0]), ("centre", [0, 0]), ("centre", [0, "a", 0]), ("views", None)]
    for name, value in damage:
        capture.eyes.write_text(json.dumps({**record, "left": {**record["left"], name: value}}))
        refused(lambda: read_eyes(capture), "eyes.json")
