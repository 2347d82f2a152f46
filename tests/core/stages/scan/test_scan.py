# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scan: a known surface seen by known cameras comes back, whichever way the camera moved and whatever its lens
bends."""

import json

import cv2
import numpy as np
import pycolmap
import pytest
import trimesh

from core.capture.capture import Capture
from core.capture.messages import CancelledError, Reporter
from core.geometry import meshes, raster
from core.geometry.meshes import Mesh
from core.geometry.views import read_views
from core.imaging import images
from core.settings.settings import from_json
from core.stages import scan
from core.stages.scan.fusion import fuse
from core.stages.scan.pairs import BASELINES_DEG, choose_pairs
from core.stages.scan.rounds import NEAR_DEG, WIDE_DEG
from core.stages.scan.stereo import DepthMap

WIDTH, HEIGHT, FOCAL = 360, 480, 460.0
CENTRE, RADII = np.array([0.0, 0.06, -0.02]), np.array([0.075, 0.09, 0.11])
"""An egg where a head would be, in metres."""


def egg() -> Mesh:
    ball = trimesh.creation.icosphere(5)
    return Mesh(np.asarray(ball.vertices) * RADII + CENTRE, np.asarray(ball.faces))


def paint(points: np.ndarray) -> np.ndarray:
    """Random, band-limited colour of surface points [N, 3] -> [N, 3] in [0.1, 0.9]: waves of 4 to 30 mm."""
    rng = np.random.default_rng(0)
    waves = rng.normal(0, 1, (60, 3))
    waves *= (2 * np.pi / rng.uniform(0.004, 0.03, 60) / np.linalg.norm(waves, axis=1))[:, None]
    return np.clip(
        0.5 + 0.12 * np.cos(points @ waves.T + rng.uniform(0, 6, 60)) @ rng.normal(0, 0.6, (60, 3)), 0.1, 0.9
    )


def photograph(capture: Capture, centres: np.ndarray, radial: float = 0.0) -> None:
    """Writes frames/ and cameras/ of the egg seen from `centres` [N, 3]."""
    model = pycolmap.Reconstruction()
    camera = pycolmap.Camera(
        model="SIMPLE_RADIAL", width=WIDTH, height=HEIGHT, params=[FOCAL, WIDTH / 2, HEIGHT / 2, radial], camera_id=1
    )
    model.add_camera_with_trivial_rig(camera)
    records = []
    for i, centre in enumerate(centres):
        z = CENTRE - centre
        z = z / np.linalg.norm(z)
        x = np.cross(z, [0, 0, 1])
        x /= np.linalg.norm(x)
        rotation = np.stack([x, np.cross(z, x), z])
        image = pycolmap.Image(name=f"{i:05d}.jpg", camera_id=1, image_id=i + 1)
        model.add_image_with_trivial_frame(image, pycolmap.Rigid3d(pycolmap.Rotation3d(rotation), -rotation @ centre))
        records.append({"name": f"{i:05d}.jpg", "video_frame": i, "time_s": None, "sharpness": 1.0, "selected": True})
    capture.cameras.mkdir(parents=True)
    model.write_binary(str(capture.cameras))
    capture.frames.mkdir()
    capture.frames_json.write_text(json.dumps({"frames": records}), encoding="utf-8")
    mesh = egg()
    caster = raster.RayCaster(mesh)
    for view in read_views(capture):
        face, bary, _ = raster.render_view(caster, view)
        points = raster.interpolate(mesh.vertices, mesh.faces, face, bary)
        picture = np.where((face >= 0)[..., None], paint(points.reshape(-1, 3)).reshape(*face.shape, 3), 0.2)
        images.write_srgb(view.path, picture.astype(np.float32), quality=95)


def around(yaws, heights=(0.0,)) -> np.ndarray:
    """Cameras 0.45 m from the egg, at angles in degrees from straight ahead."""
    e, a = (angle.ravel() for angle in np.meshgrid(np.radians(heights), np.radians(yaws), indexing="ij"))
    return CENTRE + 0.45 * np.stack([np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), np.sin(e)], 1)


def off_the_egg_mm(points: np.ndarray) -> np.ndarray:
    """Distance of points [N, 3] along the egg's normal, to first order, in millimetres; positive outside."""
    q = (points - CENTRE) / RADII
    gradient = q / RADII
    return ((q**2).sum(1) - 1) / (2 * np.linalg.norm(gradient, axis=1)) * 1000


@pytest.fixture
def capture(tmp_path, monkeypatch) -> Capture:
    # an egg is no person
    monkeypatch.setattr(
        scan.rounds.faces, "segment_person", lambda srgb: (np.abs(srgb - 0.2).max(-1) > 0.04).astype(np.float32)
    )
    return Capture(tmp_path / "œuf peint.wildcap")


@pytest.mark.parametrize(
    ("centres", "radial"),
    [(around(np.arange(-24, 25, 8)), -0.08), (around([0], np.arange(-24, 25, 8)), 0.0)],
    ids=["horizontal path, bent lens", "vertical path"],
)
def test_known_surface_comes_back(capture, centres, radial):
    photograph(capture, centres, radial)
    report = Reporter("scan")
    scan.run(capture, from_json({"scan": {"pairs": 4}}), report)
    mesh = meshes.read_ply(capture.scan)
    off = off_the_egg_mm(mesh.vertices)
    assert np.median(np.abs(off)) < 0.4 and np.percentile(np.abs(off), 95) < 1.5
    assert abs(np.median(off)) < 0.25  # neither swollen nor shrunk
    middle = centres[len(centres) // 2]
    front = raster.RayCaster(mesh).blocked(np.repeat(middle[None], 200, 0), _towards_front(middle))
    assert front.mean() > 0.97  # hardly a hole where all cameras look
    outward = (meshes.face_normals(mesh) * (mesh.vertices[mesh.faces].mean(1) - CENTRE)).sum(1) > 0
    assert outward.mean() > 0.98
    assert report.figures["points"] == len(mesh.vertices) and report.figures["left_right_disagreement_px"] < 0.5
    assert capture.picture("scan", "surface").is_file()


def _towards_front(centre: np.ndarray) -> np.ndarray:
    """Unit directions [200, 3] from a camera to the front of the egg as it sees it."""
    rng = np.random.default_rng(0)
    axis = (centre - CENTRE) / np.linalg.norm(centre - CENTRE)
    spots = rng.normal(0, 1, (5000, 3))
    spots /= np.linalg.norm(spots, axis=1, keepdims=True)
    spots = spots[spots @ axis > 0.75][:200]
    directions = spots * RADII + CENTRE - centre
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def depth_map(depth: np.ndarray, at: float = 0.0, focal: float = 250.0, baseline: float = 0.05) -> DepthMap:
    """A camera `at` metres along +Z that looks that way, its principal point in the middle."""
    origin = -np.array(depth.shape[::-1]) / 2
    return DepthMap(np.eye(3), np.array([0, 0, at]), focal, origin, depth.astype(np.float32), baseline, 0.0)


BOX = np.array([[-0.1, -0.1, 0.3], [0.1, 0.1, 0.45]])


def test_what_floats_and_what_the_maps_disagree_about_is_left_out():
    rng, maps = np.random.default_rng(0), []
    for _ in range(8):
        depth = np.full((100, 100), 0.40, np.float32)
        depth[10:14, 10:14] = 0.34  # a hair in front of everything
        depth[50:80, 50:80] += rng.choice([-0.008, 0.009], (30, 30))  # a curl that no two frames show alike
        maps.append(depth_map(cv2.blur(depth, (3, 3))))
    fused = fuse(maps, BOX, 0.002)
    assert fused.floating > 0 and abs(fused.mesh.vertices[:, 2] - 0.40).max() < 0.012
    assert fuse(maps[:1] * 8, BOX, 0.002).disagreeing == 0


def test_pairs_keep_their_baseline_and_go_all_around():
    angles = np.linspace(-75, 75, 96)
    centres = np.array([(np.sin(a), -np.cos(a), 0) for a in np.radians(angles)])
    sharpness = np.where(np.arange(96) % 2, 1.0, 0.5)
    pairs = choose_pairs(centres, sharpness, 12)
    assert len(set(pairs)) == 12
    gaps = np.array([abs(angles[a] - angles[b]) for a, b in pairs])
    assert gaps.min() >= 4 and gaps.max() <= 9
    middles = np.sort([(angles[a] + angles[b]) / 2 for a, b in pairs])
    assert middles[0] < -55 and middles[-1] > 55 and np.diff(middles).max() < 25
    assert np.mean([sharpness[a] + sharpness[b] for a, b in pairs]) > 1.8


@pytest.mark.parametrize("farther", [1.3, 2.0])
def test_pairs_of_two_passes_lie_across_the_view(farther):
    """A second pass a little higher and farther away: of neighbours in direction, one is behind the other."""
    angles = np.radians(np.linspace(-75, 75, 48))
    near = np.stack([np.sin(angles), -np.cos(angles), 0 * angles], 1)
    far = np.stack([np.sin(angles + 0.02), -np.cos(angles + 0.02), 0 * angles + 0.15], 1)
    centres = 0.5 * np.concatenate([near, farther * far])
    for baselines in (BASELINES_DEG, NEAR_DEG, WIDE_DEG):
        pairs = np.array(choose_pairs(centres, np.ones(96), 24, baselines))
        apart, middle = centres[pairs[:, 1]] - centres[pairs[:, 0]], meshes.unit(centres)[pairs].sum(1)
        assert len(pairs) > 12
        assert (np.abs((meshes.unit(apart) * meshes.unit(middle)).sum(1)) < np.sin(np.radians(46))).all()


def test_a_map_counts_by_the_angle_it_measures_under():
    """Three maps from 0.4 m that say 0.400, three from twice as far, with twice the baseline, that say 0.404."""
    maps = [
        depth_map(np.full((100, 100), depth + off), 0.40 - depth, 500 * depth, 0.05 * depth / 0.40)
        for depth, off in [(0.40, 0.0), (0.80, 0.004)] * 3
    ]
    fused = fuse(maps, BOX, 0.002)
    assert np.median(fused.mesh.vertices[:, 2]) == pytest.approx(0.402, abs=0.0003)


def test_few_photographs_far_apart_still_pair_up():
    centres = np.array([(np.sin(a), -np.cos(a), 0) for a in np.radians([-40, -20, 0, 20, 40])])
    assert sorted(choose_pairs(centres, np.ones(5), 24)) == [(0, 1), (1, 2), (2, 3), (3, 4)]
    assert choose_pairs(centres[[0, 4]], np.ones(2), 24) == []


def test_where_no_surface_is_measured_the_chain_goes_on_with_what_matches(capture, monkeypatch):
    photograph(capture, around([-6, 0, 6]))
    monkeypatch.setattr(scan.rounds.faces, "segment_person", lambda srgb: np.zeros(srgb.shape[:2], np.float32))
    places = np.array([[0.0, -0.05, 0.0], [0.01, -0.06, 0.02], [3.0, 0.0, 0.0]])
    monkeypatch.setattr(scan, "read_points", lambda capture: (places, places))
    report = Reporter("scan")
    scan.run(capture, from_json({}), report)
    assert "No surface" in report.findings[0]["problem"] and report.figures["method"] == "none"
    kept = meshes.read_ply(capture.scan, or_points=True)
    assert np.allclose(kept.vertices, places[:2]), "what lies far from the head is none of it"
    assert kept.faces.shape == (0, 3)


def test_cancel_keeps_the_old_scan(capture):
    photograph(capture, around([-6, 0, 6]))
    capture.scan.write_bytes(b"the old one")
    calls = iter([False] + [True] * 100)
    with pytest.raises(CancelledError):
        scan.run(capture, from_json({}), Reporter("scan", cancelled=lambda: next(calls)))
    assert capture.scan.read_bytes() == b"the old one"
