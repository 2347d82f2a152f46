# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Glasses: a capture with them is refused where nearly all frames agree, the artist can overrule that, doubt is a
warning; drawn pairs lie where pairs lie."""

from pathlib import Path

import cv2
import numpy as np
import pycolmap
import pytest
from skimage.data import astronaut

from core.capture.capture import Capture
from core.capture.messages import Problem, Reporter
from core.face import faces, template
from core.face.glasses import sureness
from core.geometry.views import View
from core.imaging import images
from core.settings.settings import from_json
from core.stages import frames
from core.stages.frames.glasses import SURE_LOG_ODDS, judge
from research.people.identities import reserved_seeds
from research.people.lifelike import glasses
from research.training import glasses as training

FACE = astronaut().astype(np.float32)[:300, 60:400] / 255


def with_rims(srgb: np.ndarray, thick: int = 4) -> np.ndarray:
    """Round black rims with a bridge and temples, painted over a face."""
    marks, over = faces.detect(srgb).landmarks[:, :2], srgb.copy()
    middles = [marks[list(corners)].mean(0) for corners in (faces.RIGHT_EYE, faces.LEFT_EYE)]
    reach = 0.36 * np.linalg.norm(middles[1] - middles[0])
    for middle in middles:
        cv2.circle(
            over,
            np.round(middle + [0, 0.15 * reach]).astype(int).tolist(),
            round(reach),
            (0.03, 0.03, 0.03),
            thick,
            cv2.LINE_AA,
        )
    across = (middles[1] - middles[0]) / np.linalg.norm(middles[1] - middles[0])
    ends = [
        (middles[0] + reach * across, middles[1] - reach * across),
        (middles[0] - reach * across, marks[234]),
        (middles[1] + reach * across, marks[454]),
    ]
    for a, b in ends:
        cv2.line(
            over,
            np.round(a).astype(int).tolist(),
            np.round(b).astype(int).tolist(),
            (0.03, 0.03, 0.03),
            thick,
            cv2.LINE_AA,
        )
    return over


def take(tmp_path, pictures, **settings) -> Reporter:
    folder, capture, report = tmp_path / "photographs", Capture(tmp_path / "face.wildcap"), Reporter("frames")
    folder.mkdir()
    for i, picture in enumerate(pictures):
        images.write_srgb(folder / f"{i:02d}.png", picture)
    capture.set_source(folder)
    frames.run(capture, from_json({"frames": settings}), report)
    return report


def test_rims_are_told_from_a_bare_face():
    face = faces.detect(FACE)
    assert sureness(FACE, face) < -1
    worn = with_rims(FACE)
    assert sureness(worn, faces.detect(worn)) > SURE_LOG_ODDS


def test_a_capture_with_glasses_is_refused_and_the_artist_can_overrule_it(tmp_path):
    worn = with_rims(FACE)
    pictures = [worn[k : k + 260, 2 * k : 2 * k + 280] for k in range(0, 40, 10)]
    with pytest.raises(Problem, match="wears glasses in 4 of 4 frames") as raised:
        take(tmp_path, pictures)
    assert "without glasses" in raised.value.remedy and "no_glasses" in raised.value.remedy
    overruled = tmp_path / "overruled"
    overruled.mkdir()
    report = take(overruled, pictures, no_glasses=True)
    assert report.figures["frames_with_glasses_percent"] == 100
    assert not any("glasses" in finding["problem"] for finding in report.findings)


def test_doubt_is_a_warning_and_few_photographs_refuse_nothing():
    for told in ([9.0, 9.0], [9.0, 9.0, 1.0, 1.0, 9.0], [0.7] * 10, [9.0] * 5 + [-1.0] * 5):
        report = Reporter("frames")
        judge(told, False, report)
        assert ["may wear glasses" in finding["problem"] for finding in report.findings] == [True], told
    for told in ([], [float("nan")] * 4, [-2.0] * 10 + [9.0] * 4):
        report = Reporter("frames")
        judge(told, False, report)
        assert not report.findings, told


@pytest.mark.parametrize("kind", glasses.KINDS)
def test_a_drawn_pair_stands_before_the_eyes_and_rests_on_the_ears(kind):
    landmarks = template.landmark_points(template.load())
    for seed in range(5):
        pair = glasses.sample_glasses(landmarks, np.random.default_rng(seed), kind)
        eyes = [landmarks[list(corners)].mean(0) for corners in glasses.EYES]
        for rim, eye in zip(pair.rims, eyes, strict=True):
            low, high = rim.min(0), rim.max(0)
            within = (low[[0, 2]] < eye[[0, 2]]) & (eye[[0, 2]] < high[[0, 2]])
            assert within.all(), "the pupil lies within its rim"
            assert 0.008 < eye[1] - rim[:, 1].mean() < 0.03, "and behind it"
        for temple, ear in zip(pair.bars[-2:], glasses.SIDES, strict=True):
            assert np.linalg.norm(temple[-1] - landmarks[ear]) < 0.05


def test_what_lies_behind_the_head_is_not_drawn():
    """From behind a wall only the nearer things show: a depth of nothing before the glasses leaves them whole, one of a
    wall before them takes them away."""
    landmarks = template.landmark_points(template.load())
    pair = glasses.sample_glasses(landmarks, np.random.default_rng(0), "thick")
    camera = pycolmap.Camera(model="PINHOLE", width=200, height=200, params=[300, 300, 100, 100])
    view = View("", Path(), camera, np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), np.array([0, 0, 0.4]), True)
    bare = np.full((200, 200, 3), 0.5, np.float32)
    shown = [
        glasses.put_on(bare, view, np.full((200, 200), depth), pair, 1.0, np.random.default_rng(1))
        for depth in (9.0, 0.1)
    ]
    pixels, _ = view.project(np.concatenate(pair.rims))
    rows, columns = pixels.astype(int).T[::-1]
    assert shown[0][rows, columns].mean() < 0.35, "black rims where the rims project"
    assert shown[1][rows, columns].mean() > 0.35, "hidden ones leave their lenses at most"


def test_the_plane_parts_what_can_be_parted():
    rng = np.random.default_rng(0)
    described, worn = rng.normal(size=(300, 12)), np.arange(300) % 2 == 0
    described[:, 3] += 3.0 * worn
    plane, offset = training.fit(described, worn)
    assert np.abs(plane).argmax() == 3 and ((described @ plane + offset > 0) == worn).mean() > 0.9


def test_nobody_who_is_reserved_is_learnt_from():
    learnt, held = training.seeds(200)
    assert len(learnt) == 200 and not (set(learnt) & (set(held) | set(reserved_seeds())))
