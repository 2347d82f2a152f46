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
from skimage.data import astronaut

from core.capture.capture import Capture
from core.capture.frame_records import read_frames
from core.capture.messages import CancelledError, Problem, Reporter
from core.face import faces
from core.geometry.views import read_views
from core.imaging import images
from core.settings.settings import from_json
from core.stages import cameras, frames
from core.stages.cameras.landmarks import find_landmarks
from core.stages.cameras.world import find_head, intersect_rays
from research.benchmarks.head.cameras_against_truth import similarity
from research.people.sample import write_video

DATA = Path(__file__).resolve().parents[5] / "shared" / "data"
WIDTH, HEIGHT, FOCAL = 360, 480, 420.0
POSTER, POSTER_M = astronaut()[10:298, 78:366], 0.6
"""A woman's face on a square poster of that side, in the plane y = 0, upright."""


def intrinsics() -> np.ndarray:
    return np.array([[FOCAL, 0, WIDTH / 2], [0, FOCAL, HEIGHT / 2], [0, 0, 1]])


def look(centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """rotation [3, 3] and translation [3] of a camera that looks at the origin, upright."""
    z = -centre / np.linalg.norm(centre)
    x = np.cross(z, [0, 0, 1])
    x /= np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z])
    return rotation, -rotation @ centre


def on_plane(
    picture: np.ndarray, centre: np.ndarray, side: float, depth: float, rotation: np.ndarray, translation: np.ndarray
) -> tuple:
    """A square picture in the plane y = depth about `centre` (x, z), seen by a camera: uint8 [HEIGHT, WIDTH, 3] and
    where it is."""
    n = picture.shape[0]
    texel_to_plane = np.array(
        [[side / n, 0, centre[0] - side / 2], [0, 0, depth], [0, -side / n, centre[1] + side / 2], [0, 0, 1]]
    )
    homography = intrinsics() @ np.c_[rotation, translation] @ texel_to_plane
    half = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])  # cv2 counts from pixel centres
    homography = np.linalg.inv(half) @ homography @ half
    warp = [
        cv2.warpPerspective(p, homography, (WIDTH, HEIGHT), flags=cv2.INTER_LINEAR)
        for p in (picture, np.full(picture.shape[:2], 255, np.uint8))
    ]
    return warp[0], warp[1] > 127


def film(folder: Path, angles) -> np.ndarray:
    """Photographs of the poster before a busy wall, from a metre away; returns the true camera centres."""
    rng = np.random.default_rng(0)
    wall = cv2.resize(rng.integers(0, 256, (160, 160, 3), np.uint8), (1600, 1600), interpolation=cv2.INTER_CUBIC)
    folder.mkdir(parents=True)
    centres = np.array([(np.sin(a), -np.cos(a), 0.15 * np.sin(3 * a)) for a in np.radians(angles)])
    for i, centre in enumerate(centres):
        pose = look(centre)
        picture, _ = on_plane(wall, np.zeros(2), 4.0, 0.7, *pose)
        face, seen = on_plane(np.ascontiguousarray(POSTER), np.zeros(2), POSTER_M, 0.0, *pose)
        picture[seen] = face[seen]
        images.write_srgb(folder / f"{i:03d}.png", picture.astype(np.float32) / 255)
    return centres


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
    centres = film(root / "les photos", np.linspace(-32, 32, 8))
    capture = Capture(root / "a face.wildcap")
    return capture, centres, solve(capture, root / "les photos")


def test_known_cameras_are_found(solved):
    capture, true, figures = solved
    assert figures["frames_registered"] == 8 and figures["features"] == "plain"
    assert figures["reprojection_error_px"] < 1
    assert figures["angular_coverage_deg"] == pytest.approx(64, abs=8)
    found = np.array([view.centre for view in read_views(capture)])
    scale, rotation, shift = similarity(found, true)
    off = np.linalg.norm(scale * found @ rotation.T + shift - true, axis=1)
    assert np.median(off) < 0.01  # of a metre's distance
    assert capture.picture("cameras", "world").is_file()


def test_world_is_the_heads(solved):
    """The poster's face stands upright, looks along -Y, and its eyes are 63 mm apart around the origin."""
    capture, true, _ = solved
    views = read_views(capture)
    _, rotation, _ = similarity(np.array([view.centre for view in views]), true)
    assert rotation[2, 2] > np.cos(np.radians(12))  # up is up; the woman holds her head a little askew
    assert (rotation @ [0, -1, 0])[1] < -np.cos(np.radians(35))  # and a flat picture of a turned head has no depth
    for view in (views[2], views[6]):
        face = faces.detect(view.read())
        eyes = np.array([face.landmarks[list(eye), :2].mean(0) for eye in (faces.RIGHT_EYE, faces.LEFT_EYE)])
        expected, _ = view.project(np.array([[-0.0315, 0, 0], [0.0315, 0, 0]]))
        assert np.linalg.norm(eyes - expected, axis=1).max() < 0.1 * np.linalg.norm(eyes[1] - eyes[0])


def test_same_seed_gives_the_same_cameras(solved, tmp_path):
    capture, _, _ = solved
    again = Capture(tmp_path / "again.wildcap")
    again.root.mkdir()
    shutil.copytree(capture.frames, again.frames)
    cameras.run(again, from_json({}), Reporter("cameras"))
    for first, second in zip(read_views(capture), read_views(again), strict=True):
        assert np.allclose(first.centre, second.centre, atol=1e-9), first.name


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
    folder = tmp_path / "photos"
    folder.mkdir()
    for i in range(4):
        noise = cv2.resize(rng.random((40, 30, 3), dtype=np.float32), (240, 320))
        if i == 0:
            noise[60:260, 20:220] = np.ascontiguousarray(astronaut()[30:230, 120:320]).astype(np.float32) / 255
        images.write_srgb(folder / f"{i}.png", np.clip(noise, 0, 1))
    capture = Capture(tmp_path / "face.wildcap")
    with pytest.raises(Problem, match="do not fit together") as caught:
        solve(capture, folder)
    assert "Film again" in caught.value.remedy and not capture.cameras.exists()


def test_a_camera_that_hardly_moved_is_refused(tmp_path):
    film(tmp_path / "pictures", np.linspace(-4, 4, 6))
    write_video(tmp_path / "film.mp4", (images.read_srgb(path) for path in sorted((tmp_path / "pictures").iterdir())))
    with pytest.raises(Problem, match="camera moved only 9 degrees around the head"):
        solve(Capture(tmp_path / "face.wildcap"), tmp_path / "film.mp4", features="plain")


def test_a_head_that_moves_before_a_still_background_is_told_from_one_at_rest(solved, tmp_path):
    """Cameras that hold for the background, but in every second picture the face has gone aside by a third of its
    width."""
    capture, _, _ = solved
    records = read_frames(capture).records
    model = pycolmap.Reconstruction(str(capture.cameras))
    for i, record in enumerate(records):
        picture = images.read_srgb(capture.frames / record.name)
        aside = round((record.face_box[2] - record.face_box[0]) / 3) if i % 2 else 0
        images.write_srgb(tmp_path / record.name, np.roll(picture, aside, 1))
    still, moved = (
        find_head(model, find_landmarks(records, folder, Reporter("cameras")), 0.063)
        for folder in (capture.frames, tmp_path)
    )
    assert still.still and still.error_px < 5
    assert not moved.still


def test_cancel_takes_effect_at_once_and_keeps_the_old_cameras(solved):
    capture, _, _ = solved
    before = {p.name: p.stat().st_mtime_ns for p in capture.cameras.iterdir()}
    started = time.monotonic()
    with pytest.raises(CancelledError):
        cameras.run(capture, from_json({}), Reporter("cameras", cancelled=lambda: time.monotonic() - started > 0.5))
    assert time.monotonic() - started < 2.5
    assert {p.name: p.stat().st_mtime_ns for p in capture.cameras.iterdir()} == before


def test_bust_registers(tmp_path):
    if not (DATA / "bust").is_dir():
        pytest.skip("the photographs of the bust are not at hand")
    figures = solve(Capture(tmp_path / "bust.wildcap"), DATA / "bust")
    assert figures["frames_registered"] == 5 and figures["reprojection_error_px"] < 0.6
    assert 50 < figures["angular_coverage_deg"] < 80


def test_sixteen_frames_of_a_real_video_against_its_truth(tmp_path):
    """Sparse and small, so the tolerance is five times what all 96 frames give."""
    truth = DATA / "lps_sun"
    if not truth.is_dir():
        pytest.skip("lps_sun is not at hand")
    from research.benchmarks.head.cameras_against_truth import compare

    capture = Capture(tmp_path / "lps.wildcap")
    capture.root.mkdir()
    capture.set_source(truth / "capture.mp4")
    settings = from_json({"frames": {"max_frames": 16}})
    frames.run(capture, settings, Reporter("frames"))
    cameras.run(capture, settings, Reporter("cameras"))
    figures = compare(capture, truth)
    assert figures["registered"] >= 14
    assert figures["centre_error_median_percent"] < 0.6
    # the scan holds its chin up: registration finds 7.5 degrees
    assert figures["up_tilt_deg"] < 13 and abs(figures["facing_off_deg"]) < 5
    assert figures["true_units_per_metre"] == pytest.approx(1 / 0.0553, rel=0.04)
    assert json.loads(capture.frames_json.read_text(encoding="utf-8"))["frames"][-1]["video_frame"] == 95
