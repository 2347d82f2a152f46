# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras from the face: known ones found again from landmarks alone and with matches; a profile without a face comes
in through matches."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pycolmap
import pytest

from core.capture.frame_records import FrameRecord
from core.capture.messages import Reporter
from core.face.bundle import TOLD_SIGMA_LOG, Observations, adjust, focal_deviation
from core.face.faces import Face
from core.face.landmark_model import template_landmarks
from core.stages.cameras import _left_out, solving
from core.stages.cameras.joint import FREE_SIGMA_LOG, as_bundle, refine
from core.stages.cameras.landmarks import fit_rays, pupils
from core.stages.cameras.matches import Matches, tracks
from core.stages.cameras.resection import resect
from core.stages.cameras.solving import Solved, worth
from core.stages.cameras.world import agreeing_faces, find_head
from research.benchmarks.head.cameras_against_truth import similarity
from research.people.painted_head import FOCAL, HEIGHT, WIDTH, place_camera

IDENTITY = np.random.default_rng(3).normal(0, 0.8, len(template_landmarks().basis))
PERSON = template_landmarks().shape(IDENTITY)
"""A person's landmarks: a head of the identity space, of its own face."""
REPORT = Reporter("cameras")
RECORDS = [FrameRecord(name=f"{i}.jpg", source=f"IMG {i}.jpg", sharpness=1.0, selected=True) for i in range(4)]


def seen(view, rng) -> Face:
    pixels, _ = view.project(PERSON + rng.normal(0, 0.0005, PERSON.shape))
    pixels = pixels + rng.normal(0, 0.5, pixels.shape)
    landmarks = np.concatenate([pixels, np.zeros((468, 1))], 1).astype(np.float32)
    return Face((*pixels.min(0), *pixels.max(0)), landmarks, 1.0)


def matched(views: dict, rng, count: int = 300) -> Matches:
    """Points on a ball about the size of a head, and behind it, seen by all; a third of the matches are wrong."""
    points = rng.normal(size=(count, 3))
    points = points / np.linalg.norm(points, axis=1, keepdims=True) * rng.uniform(0.08, 0.35, (count, 1))
    keypoints = {name: view.project(points)[0] + rng.normal(0, 0.3, (count, 2)) for name, view in views.items()}
    pairs = {}
    for i, first in enumerate(views):
        for second in list(views)[i + 1 :]:
            index = np.stack([np.arange(count)] * 2, 1)
            index[::3, 1] = rng.permutation(index[::3, 1])
            pairs[first, second] = index
    return Matches(keypoints, pairs)


def off(model, views: dict) -> tuple[np.ndarray, np.ndarray]:
    """Errors of the centres [N] as shares of the distance, and of the rotations [N] in degrees, after the similarity of
    the centres."""
    found = sorted(model.images.values(), key=lambda image: image.name)
    true = [views[image.name] for image in found]
    centres, truth = np.array([image.projection_center() for image in found]), np.array([view.centre for view in true])
    scale, rotation, shift = similarity(centres, truth)
    turned = [view.rotation @ rotation for view in true]
    placed = [image.cam_from_world().rotation.matrix() for image in found]
    cosines = (np.einsum("nij,nij->n", turned, placed) - 1) / 2
    away = np.linalg.norm(scale * centres @ rotation.T + shift - truth, axis=1) / 0.55
    return away, np.degrees(np.arccos(np.clip(cosines, -1, 1)))


@pytest.fixture(scope="module")
def scene():
    rng = np.random.default_rng(0)
    views = {f"{i}.jpg": place_camera(azimuth, 0.05 * np.sin(i)) for i, azimuth in enumerate((-45, -20, 0, 25, 50))}
    return rng, views, {name: seen(view, rng) for name, view in views.items()}


def group(names, focal_px=FOCAL) -> list[dict]:
    return [{"names": list(names), "width": WIDTH, "height": HEIGHT, "focal_px": focal_px}]


def model_of(views: dict, lenses: tuple[float, ...], off_m=lambda: 0.0) -> pycolmap.Reconstruction:
    """The true cameras, moved by `off_m()`, with lenses of these focal lengths; of two, the second has taken the last
    two frames."""
    model = pycolmap.Reconstruction()
    for number, focal in enumerate(lenses, 1):
        params = [focal, WIDTH / 2, HEIGHT / 2, 0]
        camera = pycolmap.Camera(camera_id=number, model="SIMPLE_RADIAL", width=WIDTH, height=HEIGHT, params=params)
        model.add_camera_with_trivial_rig(camera)
    for number, (name, view) in enumerate(views.items(), 1):
        lens = len(lenses) if number > len(views) - 2 else 1
        shift = view.translation + off_m()
        if len(lenses) == 1:
            shift *= [1, 1, lenses[0] / FOCAL]
        pose = pycolmap.Rigid3d(np.concatenate([view.rotation, shift[:, None]], 1))
        model.add_image_with_trivial_frame(pycolmap.Image(name=name, camera_id=lens, image_id=number), pose)
    return model


def test_landmarks_alone_place_the_cameras(scene):
    _, views, found = scene
    result = resect(group(views), found, Matches(), REPORT)
    centres, turns = off(result.model, views)
    assert np.median(centres) < 0.02 and np.median(turns) < 1.5
    assert result.tracks == 0 and not result.refined and result.landmark_px < 2


def test_an_unknown_focal_length_is_found(scene):
    _, views, found = scene
    result = resect(group(views, None), found, Matches(), REPORT)
    assert result.model.cameras[1].params[0] == pytest.approx(FOCAL, rel=0.15)


def test_matches_refine_the_cameras_and_bring_in_a_profile(scene):
    """A focal length that a file rounded is put right as well."""
    rng, views, found = scene
    views = views | {"9.jpg": place_camera(88, 0.05)}
    result = resect(group(views, 0.975 * FOCAL), found, matched(views, rng), REPORT)
    centres, turns = off(result.model, views)
    assert result.by_matches == ["9.jpg"] and result.refined and result.tracks > 150
    assert centres.max() < 0.006 and turns.max() < 0.3
    assert result.model.cameras[1].params[0] == pytest.approx(FOCAL, rel=0.01)


def test_wrong_matches_do_not_count_as_refinement(scene):
    rng, views, found = scene
    keypoints = {name: rng.uniform(0, WIDTH, (300, 2)) for name in views}
    index = np.stack([np.arange(300)] * 2, 1)
    wrong = Matches(keypoints, {(a, b): index for a in views for b in views if a < b})
    assert not resect(group(views), found, wrong, REPORT).refined


def test_fewer_than_two_faces_give_nothing(scene):
    _, views, found = scene
    assert resect(group(views), {"0.jpg": found["0.jpg"]}, Matches(), REPORT) is None


def test_cameras_that_are_nearly_right_are_made_right_with_the_face(scene):
    """Off by some pixels and a tenth of the focal length, with a profile that the net mistakes and one without a
    camera."""
    rng, views, found = scene
    views = views | {"8.jpg": place_camera(-85, 0.05), "9.jpg": place_camera(88, 0.05)}
    mistaken, matches = found | {"8.jpg": seen(place_camera(-40, 0.05), rng)}, matched(views, rng)
    placed = {name: view for name, view in views.items() if name != "9.jpg"}
    start = model_of(placed, (1.08 * FOCAL,), lambda: rng.normal(0, 0.002, 3))
    assert set(agreeing_faces(start, mistaken)) == set(found)
    refined = refine(start, mistaken, matches, {}, REPORT, group(["9.jpg"], None))
    centres, turns = off(refined, views)
    assert refined.num_reg_images() == 7 and centres.max() < 0.01 and turns.max() < 0.5
    assert refined.cameras[1].params[0] == pytest.approx(FOCAL, rel=0.02)
    assert find_head(refined, mistaken, 0.063).unlike_m < 0.002


def test_a_given_focal_length_is_the_files_and_an_unknown_one_beside_it_is_free(scene):
    """What COLMAP has made of the given one, 8 % too much, is not what the file says."""
    model = model_of(scene[1], (1.08 * FOCAL, 0.9 * FOCAL))
    images = sorted(model.images.values(), key=lambda image: image.name)
    bundle = as_bundle(model, images, {image.name: FOCAL for image in images[:-2]})
    assert bundle.focal.tolist() == pytest.approx([1.08 * FOCAL, 0.9 * FOCAL])
    assert bundle.focal_prior.tolist() == pytest.approx([FOCAL, 0.9 * FOCAL])
    assert bundle.focal_spread.tolist() == [TOLD_SIGMA_LOG, FREE_SIGMA_LOG]
    alone = adjust(bundle, Observations(np.zeros(1, int), np.zeros(1, int), np.zeros((1, 2))))
    assert alone.focal == pytest.approx([FOCAL, 0.9 * FOCAL], rel=0.01), "nothing but the priors says anything"


@pytest.mark.parametrize(
    ("ratio", "deviation", "used", "words"),
    [
        (1.6, 0.06, 1.0, "by the pictures"),
        (0.6, 0.03, 1.0, "by the pictures"),
        (1.04, 0.0005, 1.04, "by the metadata"),
        (1.02, 0.03, 1.0, ""),
    ],
)
def test_of_a_tag_and_matches_that_contradict_it_the_surer_one_is_used(scene, ratio, deviation, used, words):
    rng, views, found = scene
    matches, report = matched(views, rng), Reporter("cameras")
    told, tags = dict.fromkeys(views, ratio * FOCAL), dict.fromkeys(views, deviation)
    refined = refine(model_of(views, (FOCAL,)), found, matches, told, report, tags=tags)
    assert refined.cameras[1].params[0] == pytest.approx(used * FOCAL, rel=0.015)
    assert [words in finding["problem"] for finding in report.findings] == [True] * bool(words)


def test_a_focal_length_is_as_uncertain_as_it_comes_out_and_more_so_on_a_flat_arc():
    rng, deviations = np.random.default_rng(5), []
    for reach in (50, 12):
        views = {f"{i}.jpg": place_camera(azimuth, 0.0) for i, azimuth in enumerate(np.linspace(-reach, reach, 5))}
        model = model_of(views, (FOCAL,))
        images = sorted(model.images.values(), key=lambda image: image.name)
        points = rng.normal(0, 0.07, (150, 3))
        start = replace(as_bundle(model, images, {}), feature_px=0.3)
        start = replace(start, points=np.concatenate([start.points, points]))
        camera, point = (index.ravel() for index in np.indices((5, len(points))))
        off_by = []
        for _ in range(4):
            pixel = np.concatenate([view.project(points)[0] for view in views.values()])
            observed = Observations(camera, 468 + point, pixel + rng.normal(0, 0.3, pixel.shape))
            bundle = adjust(start, observed)
            off_by.append(abs(np.log(bundle.focal[0] / FOCAL)) / focal_deviation(bundle, observed)[0])
        deviations.append(focal_deviation(bundle, observed)[0])
        assert 0.1 < np.sqrt(np.mean(np.square(off_by))) < 2.2
    assert deviations[1] > 3 * deviations[0]


def test_a_late_frame_gets_the_lens_of_its_focal_length(scene):
    """Two settings of a zoom take pictures of one size."""
    rng, views, found = scene
    late = {"8.jpg": place_camera(80, 0.05), "9.jpg": place_camera(88, 0.05)}
    names, middle = list(views), np.array([WIDTH / 2, HEIGHT / 2])
    focal = dict.fromkeys(names[:-2], FOCAL) | dict.fromkeys(names[-2:], 1.7 * FOCAL)
    faces, matches = dict(found), matched(views | late, rng)
    for name in names[-2:]:
        marks = found[name].landmarks.copy()
        marks[:, :2] = middle + 1.7 * (marks[:, :2] - middle)
        faces[name] = replace(found[name], landmarks=marks)
        matches.keypoints[name] = middle + 1.7 * (matches.keypoints[name] - middle)
    missing = group(["8.jpg"]) + group(["9.jpg"], 2.5 * FOCAL)
    refined = refine(model_of(views, (FOCAL, 1.7 * FOCAL)), faces, matches, focal, REPORT, missing)
    lens_of = {image.name: image.camera_id for image in refined.images.values()}
    assert lens_of["8.jpg"] == 1 and "9.jpg" not in lens_of, "of that zoom nothing is known"


def test_cameras_without_matches_stay_what_they_are(scene):
    rng, views, found = scene
    start = model_of(views, (FOCAL,), lambda: rng.normal(0, 0.001, 3))
    kept = refine(start, found, Matches({name: np.zeros((0, 2)) for name in views}, {}), {}, REPORT)
    assert kept.cameras[1].params[0] == FOCAL and kept.num_reg_images() == len(views)


def test_of_two_ways_the_one_that_places_more_frames_wins_unless_nothing_but_the_face_bears_it_out():
    worths = [
        worth(Solved(SimpleNamespace(num_reg_images=lambda frames=frames: frames), way, None, {}, refined=refined))
        for way, frames, refined in (("face", 5, True), ("skin", 3, True), ("face", 3, True), ("face", 5, False))
    ]
    assert all(better > worse for better, worse in zip(worths, worths[1:], strict=False))


@pytest.mark.parametrize(("time_s", "source"), [(None, "photographs"), (0.5, "frames")])
@pytest.mark.parametrize("blurred", [False, True])
def test_frames_that_did_not_fit_are_named_by_their_source(scene, time_s, source, blurred):
    model, report = model_of(dict(list(scene[1].items())[:3]), (FOCAL,)), Reporter("cameras")
    records = [replace(record, time_s=time_s) for record in RECORDS]
    records[3] = replace(records[3], sharpness=0.1 if blurred else 1.0)
    _left_out(Solved(model, "plain", None, {}), records, {each.name: each.shown for each in records}, report)
    (finding,) = report.findings
    assert finding["frames"] == ["IMG 3.jpg"] and source in finding["problem"]
    assert ("blurred" in finding["problem"]) == blurred


def test_a_mirrored_photograph_is_named_by_its_source(scene, monkeypatch):
    monkeypatch.setattr(solving, "find_mirrored", lambda names, *others: ["0.jpg"])
    monkeypatch.setattr(solving, "camera_groups", lambda records, folder: [])
    monkeypatch.setattr(solving, "resect", lambda *given: None)
    _, fault = solving._by_face(RECORDS, SimpleNamespace(frames=None), scene[2], Matches(), None, REPORT)
    assert "IMG 0.jpg" in fault


def test_tracks_hang_together_and_ambiguous_ones_go():
    pixels = {name: np.zeros((5, 2)) for name in "abc"}
    pairs = {
        ("a", "b"): np.array([[0, 0], [1, 1]]),
        ("b", "c"): np.array([[0, 3], [1, 2]]),
        ("a", "c"): np.array([[4, 2]]),
    }
    # a1-b1-c2-a4 meets a twice
    assert sorted(map(sorted, tracks(Matches(pixels, pairs)))) == [[("a", 0), ("b", 0), ("c", 3)]]


def test_head_of_known_size_against_rays():
    origins = np.array([place_camera(azimuth).centre for azimuth in (-30, -10, 10, 30)])
    directions = PERSON[None] - origins[:, None]
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    scale, rotation, translation, coefficients = fit_rays(origins, directions, PERSON)
    (right, left), (true_right, true_left) = pupils(coefficients), pupils(IDENTITY)
    assert scale * np.linalg.norm(left - right) == pytest.approx(np.linalg.norm(true_left - true_right), rel=0.035)
    assert np.degrees(np.arccos((np.trace(rotation) - 1) / 2)) < 1.5 and np.linalg.norm(translation) < 0.003
