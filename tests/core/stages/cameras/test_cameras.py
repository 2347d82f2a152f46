# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras: known ones found again, the head upright and in metres, and what cannot be solved told in a sentence."""

import json
import shutil
import time
from pathlib import Path

import cv2
import numpy as np
import pycolmap
import pytest
from scipy.spatial.transform import Rotation
from skimage.data import astronaut

from core.capture.capture import Capture
from core.capture.frame_records import FrameRecord, read_frames
from core.capture.messages import CancelledError, Reporter
from core.face import faces
from core.geometry.views import read_views
from core.imaging import images
from core.settings.settings import from_json
from core.stages import cameras, frames
from core.stages.cameras.drawing import draw_cameras
from core.stages.cameras.landmarks import find_landmarks
from core.stages.cameras.solving import Solved
from core.stages.cameras.world import PUPILS_M, HeadFrame, find_head, intersect_rays
from research.benchmarks.head.cameras_against_truth import compare, similarity
from research.people.painted_head import photograph, place_camera
from tests.fixtures.refused import refused

DATA = Path(__file__).resolve().parents[5] / "shared" / "data"


def photographed(folder: Path, azimuths) -> np.ndarray:
    """Photographs of a person before a busy wall; returns the true camera centres."""
    views = [place_camera(azimuth, 0.08 * np.sin(3 * i)) for i, azimuth in enumerate(azimuths)]
    for i, view in enumerate(views):
        images.write_srgb(folder / f"{i:03d}.png", photograph(view))
    return np.array([view.centre for view in views])


def solve(capture: Capture, source: Path, report: Reporter | None = None, **settings) -> dict:
    capture.root.mkdir(parents=True, exist_ok=True)
    capture.set_source(source)
    chosen = from_json({"cameras": settings})
    frames.run(capture, chosen, Reporter("frames"))
    report = report or Reporter("cameras")
    cameras.run(capture, chosen, report)
    return report.figures


@pytest.fixture(scope="module")
def solved(tmp_path_factory) -> tuple[Capture, np.ndarray, dict]:
    root = tmp_path_factory.mktemp("caméras d'été")
    centres = photographed(root / "les photos", np.linspace(-32, 32, 7))
    capture = Capture(root / "a face.wildcap")
    return capture, centres, solve(capture, root / "les photos")


def test_known_cameras_are_found_in_the_heads_world(solved):
    """The face stands upright, looks along -Y, and its eyes are 63 mm apart around the origin."""
    capture, true, figures = solved
    assert figures["frames_registered"] == 7 and figures["features"] == "plain"
    assert figures["reprojection_error_px"] < 1
    assert figures["angular_coverage_deg"] == pytest.approx(64, abs=8)
    assert capture.picture("cameras", "world").is_file()
    views = read_views(capture)
    centres = np.array([view.centre for view in views])
    scale, rotation, shift = similarity(centres, true)
    off = np.linalg.norm(scale * centres @ rotation.T + shift - true, axis=1)
    assert np.median(off) < 0.005 and scale == pytest.approx(1, abs=0.06)  # in metres
    assert np.degrees(Rotation.from_matrix(rotation).magnitude()) < 8
    for view in (views[1], views[5]):
        face = faces.detect(view.read())
        eyes = np.array([face.landmarks[list(eye), :2].mean(0) for eye in (faces.RIGHT_EYE, faces.LEFT_EYE)])
        expected, _ = view.project(np.array([[-0.0315, 0, 0], [0.0315, 0, 0]]))
        assert np.linalg.norm(eyes - expected, axis=1).max() < 0.1 * np.linalg.norm(eyes[1] - eyes[0])


def test_rays_meet_robustly():
    rng = np.random.default_rng(1)
    points = rng.normal(0, 0.1, (20, 3))
    origins = np.array([(np.sin(a), -np.cos(a), 0.1) for a in np.linspace(-0.6, 0.6, 8)])
    directions = points[None] - origins[:, None]
    directions[3] += rng.normal(0, 0.1, (20, 3))  # one view is plainly wrong
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    found, angles = intersect_rays(origins, directions)
    assert np.linalg.norm(found - points, axis=1).max() < 2e-3
    assert np.median(angles[3]) > 10 * np.median(np.delete(angles, 3, 0))


def test_frames_without_common_structure_are_refused(tmp_path):
    rng = np.random.default_rng(3)
    for i in range(4):
        noise = cv2.resize(rng.random((40, 30, 3), dtype=np.float32), (240, 320))
        if i == 0:
            noise[60:260, 20:220] = astronaut()[30:230, 120:320] / np.float32(255)
        images.write_srgb(tmp_path / "photos" / f"{i}.png", np.clip(noise, 0, 1))
    capture = Capture(tmp_path / "face.wildcap")
    problem = refused(lambda: solve(capture, tmp_path / "photos", features="plain"), "do not fit together")
    assert "Film again" in problem.remedy and not capture.cameras.exists()


def test_a_film_whose_camera_hardly_moved_is_refused(solved, tmp_path, monkeypatch):
    again = Capture(tmp_path / "film.wildcap")
    shutil.copytree(solved[0].frames, again.frames)
    frames_json = json.loads(again.frames_json.read_text(encoding="utf-8"))
    again.frames_json.write_text(json.dumps(frames_json | {"kind": "video"}))
    head = HeadFrame(pycolmap.Sim3d(), 1.0, 0.01, PUPILS_M, 0.001)
    still = Solved(pycolmap.Reconstruction(str(solved[0].cameras)), "plain", head, {})
    monkeypatch.setattr(cameras, "solve", lambda *given: still)
    monkeypatch.setattr(cameras, "LEAST_COVERAGE_DEG", 90.0)
    refused(lambda: cameras.run(again, from_json({}), Reporter("cameras")), "moved only 6", " degrees")
    assert not again.cameras.exists()


def test_a_head_that_moves_before_a_still_background_is_told_from_one_at_rest(solved, tmp_path):
    """Cameras that hold for the background, but in every second picture the face has gone aside by a third of its
    width."""
    capture, records = solved[0], read_frames(solved[0]).records
    for i, record in enumerate(records):
        aside = round((record.face_box[2] - record.face_box[0]) / 3) if i % 2 else 0
        images.write_srgb(tmp_path / record.name, np.roll(images.read_srgb(capture.frames / record.name), aside, 1))
    model, report = pycolmap.Reconstruction(str(capture.cameras)), Reporter("cameras")
    still, moved = (
        find_head(model, find_landmarks(records, folder, report), 0.063) for folder in (capture.frames, tmp_path)
    )
    assert still.still and still.error_px < 5 and not moved.still


def test_cancel_takes_effect_at_once_and_keeps_the_old_cameras(solved):
    def times() -> dict:
        return {path.name: path.stat().st_mtime_ns for path in solved[0].cameras.iterdir()}

    before, started = times(), time.monotonic()
    report = Reporter("cameras", cancelled=lambda: time.monotonic() - started > 0.5)
    with pytest.raises(CancelledError):
        cameras.run(solved[0], from_json({}), report)
    assert time.monotonic() - started < 2.5 and times() == before


def test_some_frames_of_a_real_video_against_its_truth(tmp_path):
    """Sparse and small, so the tolerance is five times what all 96 frames give."""
    truth = DATA / "lps_sun"
    if not truth.is_dir():
        pytest.skip("lps_sun is not at hand")
    capture = Capture(tmp_path / "lps.wildcap")
    capture.root.mkdir()
    capture.set_source(truth / "capture.mp4")
    settings = from_json({"frames": {"max_frames": 12}})
    frames.run(capture, settings, Reporter("frames"))
    cameras.run(capture, settings, Reporter("cameras"))
    figures = compare(capture, truth)
    assert figures["registered"] >= 11
    assert figures["centre_error_median_percent"] < 0.6
    # the scan holds its chin up: registration finds 7.5 degrees
    assert figures["up_tilt_deg"] < 13 and abs(figures["facing_off_deg"]) < 5
    assert figures["true_units_per_metre"] == pytest.approx(1 / 0.0553, rel=0.04)
    assert json.loads(capture.frames_json.read_text(encoding="utf-8"))["frames"][-1]["video_frame"] == 95


@pytest.mark.parametrize(("focal", "distance"), [(18.0, 0.5), (400.0, 0.05), (400.0, -0.3), (1e9, 0.5)])
def test_axes_that_a_camera_cannot_see_are_left_out_of_the_picture(tmp_path, focal, distance):
    images.write_srgb(tmp_path / "0.jpg", np.full((64, 48, 3), 0.5, np.float32))
    model = pycolmap.Reconstruction()
    params = [focal, 24, 32, -0.4]
    model.add_camera_with_trivial_rig(
        pycolmap.Camera(camera_id=1, model="SIMPLE_RADIAL", width=48, height=64, params=params)
    )
    towards = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, distance]])
    model.add_image_with_trivial_frame(
        pycolmap.Image(name="0.jpg", camera_id=1, image_id=1), pycolmap.Rigid3d(towards.astype(float))
    )
    record = FrameRecord(name="0.jpg", sharpness=1.0, selected=True)
    picture = draw_cameras(model, [record], tmp_path, 64)
    assert picture.shape == (64, 48 + 64, 3) and np.isfinite(picture).all()
