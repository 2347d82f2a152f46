# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras of a film whose subject swayed before the room: known poses of a head found again by what matches on it, and
a head at rest left alone."""

from dataclasses import replace

import numpy as np
import pycolmap
import pytest
from scipy.spatial.transform import Rotation

from core.capture.capture import Capture
from core.capture.frame_records import VIDEO, FrameRecord, Frames
from core.capture.messages import Reporter
from core.face import template
from core.face.faces import Face
from core.geometry.models import pose_of
from core.settings.settings import from_json
from core.stages.cameras import landmarks
from core.stages.cameras.matches import Matches
from core.stages.cameras.settled import MOST_LEFT_SHARE, head_boxes, on_head, settle
from core.stages.cameras.solving import Solved, _refined
from core.stages.cameras.world import PUPILS_M, HeadFrame
from research.people.painted_head import place_camera

AZIMUTHS = np.linspace(-40, 40, 17)
NEIGHBOURS, WRONG, NOISE_PX, RAGGED_PX = 5, 0.2, 0.3, 2.0
REPORT = Reporter("cameras")
IN_HEAD = HeadFrame(pycolmap.Sim3d(), 1.0, 0.01, PUPILS_M, 0.001)


def filmed(sway_m: float = 0.0, sway_deg: float = 0.0, count: int = 700, ragged: float = 0.0):
    """The model of the cameras in the room's world, all matches, and where the head was: its rotations [N, 3, 3] and
    shifts [N, 3]. `ragged`: share of the head's points that are seen elsewhere in every frame, as hair is."""
    rng = np.random.default_rng(1)
    views = [place_camera(azimuth, 0.05 * np.sin(i), scale=1.5) for i, azimuth in enumerate(AZIMUTHS)]
    head = template.load().vertices
    head = head[(head[:, 1] < -0.01) & (head[:, 2] > -0.1)]
    head = head[rng.choice(len(head), count, replace=False)]
    room = rng.uniform([-1.5, 0.8, -1.0], [1.5, 1.4, 1.0], (count, 3))
    turns = Rotation.from_rotvec(np.radians(sway_deg) * rng.normal(size=(len(views), 3))).as_matrix()
    shifts = sway_m * rng.normal(size=(len(views), 3))
    model, keypoints = pycolmap.Reconstruction(), {}
    model.add_camera_with_trivial_rig(views[0].camera)
    for i, (view, turn, shift) in enumerate(zip(views, turns, shifts, strict=True)):
        name = f"{i:02d}.jpg"
        pixels = np.concatenate([view.project(head @ turn.T + shift)[0], view.project(room)[0]])
        keypoints[name] = pixels + rng.normal(0, NOISE_PX, pixels.shape)
        keypoints[name][: round(ragged * count)] += rng.normal(0, RAGGED_PX, (round(ragged * count), 2))
        image = pycolmap.Image(name=name, camera_id=1, image_id=i + 1, keypoints=np.zeros((0, 2)))
        model.add_image_with_trivial_frame(image, pycolmap.Rigid3d(np.c_[view.rotation, view.translation]))
    pairs = {}
    for i in range(len(views)):
        for j in range(i + 1, min(i + NEIGHBOURS, len(views))):
            index = np.stack([np.arange(2 * count)] * 2, 1)
            wrong = rng.random(len(index)) < WRONG
            index[wrong, 1] = rng.permutation(index[wrong, 1])
            pairs[f"{i:02d}.jpg", f"{j:02d}.jpg"] = index
    return model, Matches(keypoints, pairs), turns, shifts


def missed_px(model, true, turns, shifts) -> np.ndarray:
    """How far the face's points lie from where they were filmed, per frame, if the head is laid where the frames
    together see it best: [N]."""
    points = template.load().vertices
    points = points[(points[:, 1] < -0.03) & (points[:, 2] > -0.09)][::20]
    by_name = {image.name: pose_of(image) for image in model.images.values()}
    poses, aims, rays = [], [], []
    for image, turn, shift in zip(
        sorted(true.images.values(), key=lambda image: image.name), turns, shifts, strict=True
    ):
        pose = by_name[image.name]
        local = (points @ turn.T + shift) @ pose_of(image).rotation.matrix().T + pose_of(image).translation
        aim = np.asarray(true.cameras[1].img_from_cam(local))
        ray = np.c_[model.cameras[1].cam_from_img(aim), np.ones(len(aim))] @ pose.rotation.matrix()
        poses.append(pose)
        aims.append(aim)
        rays.append(ray / np.linalg.norm(ray, axis=1, keepdims=True))
    across = np.eye(3) - np.stack(rays)[..., None] * np.stack(rays)[..., None, :]  # [views, N, 3, 3]
    centres = np.array([-pose.rotation.matrix().T @ pose.translation for pose in poses])
    place = np.linalg.solve(across.sum(0), np.einsum("vnij,vj->ni", across, centres)[..., None])[..., 0]
    pixels = [model.cameras[1].img_from_cam(place @ p.rotation.matrix().T + p.translation) for p in poses]
    return np.linalg.norm(np.array(pixels) - aims, axis=2).mean(1)


@pytest.mark.parametrize("every", [1, 2])
def test_the_head_is_followed_where_it_swayed_and_frames_that_do_not_tell_are_placed_by_those_that_do(every):
    model, matches, turns, shifts = filmed(0.0015, 0.6)
    names = sorted(matches.keypoints)
    settled, left = settle(model, IN_HEAD, matches, REPORT, *([names[::every]] if every > 1 else []))
    assert left < MOST_LEFT_SHARE and sorted(image.name for image in settled.images.values()) == names
    before, after = (missed_px(each, model, turns, shifts)[every - 1 :: every].mean() for each in (model, settled))
    assert after < 0.25 * before and after < 0.3
    points = np.array([point.xyz for point in settled.points3D.values()])
    on_skin = np.linalg.norm(points[:, None] - template.load().vertices[None, ::5], axis=2).min(1)
    assert np.median(on_skin) < 0.005, "the world stays the head's, in metres"


@pytest.mark.parametrize(
    ("noise_px", "options", "by", "least"),
    [
        pytest.param(1.0, {}, None, 1.0, id="a head at rest, however noisy"),
        pytest.param(NOISE_PX, {"ragged": 0.6}, None, MOST_LEFT_SHARE, id="hair that fits together nowhere"),
        pytest.param(NOISE_PX, {"sway_m": 0.003, "sway_deg": 1.0, "count": 150}, None, None, id="hardly a match"),
        pytest.param(NOISE_PX, {"count": 50}, [], None, id="no frame shows the head large enough"),
        pytest.param(NOISE_PX, {"count": 50}, ["00.jpg", "08.jpg"], None, id="two frames do"),
    ],
)
def test_without_a_motion_that_is_sure_the_cameras_of_the_room_stay(monkeypatch, noise_px, options, by, least):
    """Poses of its own would fit all matches better, and tell nothing of those that had no say in them."""
    monkeypatch.setattr(f"{__name__}.NOISE_PX", noise_px)
    model, matches, _, _ = filmed(**options)
    settled, left = settle(model, IN_HEAD, matches, REPORT, *([] if by is None else [by]))
    assert settled is model and (left is None if least is None else left > least)


def test_a_sway_of_a_fifth_of_a_millimetre_is_seen():
    model, matches, turns, shifts = filmed(0.0002, 0.1)
    settled, left = settle(model, IN_HEAD, matches, REPORT)
    assert left < MOST_LEFT_SHARE
    assert missed_px(settled, model, turns, shifts).mean() < 0.25 * missed_px(model, model, turns, shifts).mean()


def test_a_film_of_a_tiny_head_is_not_looked_at_in_parts_which_are_as_large_for_a_child(tmp_path):
    """The pupils' distance that is set makes the world smaller, and the head in it. In pictures of 100 by 133 pixels
    the head is 40 wide."""
    model, matches, _, _ = filmed(count=50)
    small = replace(IN_HEAD, world_from_model=pycolmap.Sim3d(50 / 63, pycolmap.Rotation3d(np.eye(3)), np.zeros(3)))
    assert head_boxes(model, small) == head_boxes(model, IN_HEAD)
    model.cameras[1].rescale(100, 133)
    records = tuple(FrameRecord(name=f"{i:02d}.jpg", sharpness=1.0, selected=False) for i in range(len(AZIMUTHS)))
    solved = Solved(model, "plain", IN_HEAD, {}, matches=matches)
    assert _refined(solved, Frames(records, VIDEO), Capture(tmp_path / "a"), from_json({}), REPORT) is solved


@pytest.mark.parametrize(("time_s", "looks"), [(1.0, [True, True]), (None, [True, True, False])])
def test_a_frame_without_a_face_is_looked_at_once_in_a_film(monkeypatch, tmp_path, time_s, looks):
    """Following the last face comes first there; in a photograph, after looking anew."""
    face, asked = Face((0, 0, 9, 9), np.zeros((468, 3)), 1.0), []

    def detect(srgb, last=None):
        asked.append(last is None or time_s is not None)
        return face if len(asked) == 1 else None

    monkeypatch.setattr(landmarks.faces, "detect", detect)
    monkeypatch.setattr(landmarks.images, "read_srgb", lambda path: None)
    records = [FrameRecord(name=f"{i}.jpg", sharpness=1.0, selected=False, time_s=time_s) for i in range(2)]
    assert list(landmarks.find_landmarks(records, tmp_path, REPORT)) == ["0.jpg"]
    assert asked == looks


def test_only_what_matches_on_the_head_counts():
    model, matches, _, _ = filmed(count=300)
    images = sorted(model.images.values(), key=lambda image: image.name)
    kept = on_head(model, images, matches)
    index = np.concatenate(list(kept.pairs.values()))
    of_room = (index >= 300).any(1).mean()
    # the wall behind the head's outline stays
    assert 0.9 * len(np.concatenate(list(matches.pairs.values()))) / 2 * 0.8 < len(index) and of_room < 0.25
