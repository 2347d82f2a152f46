# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What Cycles draws of a person is what the truth says: under an even light the picture is the albedo, each part is
where it is told, and a head that moves together with its camera leaves the picture as it was."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("OpenImageIO")
pytest.importorskip("pycolmap")
pytest.importorskip("bpy")

from core.imaging import images  # noqa: E402
from research.people import sample, scene  # noqa: E402
from research.people.lifelike import figure, filmed, person, truth  # noqa: E402

SCALE, SAMPLES = 0.25, 24
SHIRT, IRIS = (0.05, 0.30, 0.10), (0.02, 0.06, 0.25)
ELSEWHERE = np.array([0.3, -0.2, 0.1])  # metres
EVEN = scene.SceneLight((1.0, 1.0, 1.0))


@pytest.fixture(scope="module")
def pictured(tmp_path_factory):
    """A bald man in a green shirt with stubble, blue eyes and black brows: two linear frames under an even light of
    radiance 1, and their truth."""
    asked = replace(
        person.sample_person(5),
        hair="none",
        beard="stubble",
        beard_length=0.002,
        openness=0.95,
        gaze=(0.0, 0.0),
        iris=IRIS,
        brow=1.0,
        brow_colour=tuple(person.BROWS[0]),
        clothes=SHIRT,
        shade=0.0,
    )
    someone = figure.make_figure(asked, 512)
    camera = scene.looking(np.array([[0.0, -0.42, 0.0]]), np.array([[0.0, 0.0, -0.03]]), np.zeros(1))
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, :3, 3] = ELSEWHERE
    work = tmp_path_factory.mktemp("rendered")
    filmed.render(work, someone, EVEN, scene.Shot(poses @ camera, [0, 1], SAMPLES, SCALE, poses, room=False))
    frames = [images.read_linear(work / f"{k:05d}.exr")[..., :3] for k in range(2)]
    return frames, truth.trace_truth(truth.Scene(someone), sample.view_of(camera[0], SCALE), over=3)


def of(found, part, least=0.95):
    """Where a part covers the pixels, bool [h, w]."""
    return found.parts[..., figure.PARTS.index(part)] > least


def test_under_an_even_light_the_picture_is_the_albedo(pictured):
    """But for what lies in its own shade, for gloss, and for light that goes from skin to skin."""
    (frame, _), found = pictured
    face = found.face & of(found, "skin")
    assert face.sum() > 2000
    albedo = found.seen[face].ravel()
    slope, gloss = np.linalg.lstsq(np.stack([albedo, np.ones_like(albedo)], 1), frame[face].ravel(), rcond=None)[0]
    assert 0.85 < slope < 1.05 and 0.0 < gloss < 0.06
    same = np.corrcoef(np.log(frame[face]).ravel(), np.log(found.seen[face]).ravel())[0, 1]
    assert same > 0.9, "spots and colours are where the truth has them"


def test_parts_have_their_own_colours_where_the_truth_has_the_parts(pictured):
    (frame, _), found = pictured
    shirt = of(found, "clothes")
    green = np.median(frame[shirt], 0)
    assert green / green.sum() == pytest.approx(np.array(SHIRT) / sum(SHIRT), abs=0.07)
    skin = np.median(frame[found.face & of(found, "skin")], 0).mean()
    assert np.median(frame[of(found, "brows", 0.5)]) < 0.6 * skin, "black brows"


def test_eyes_are_blue_and_black_in_the_middle_and_white_beside(pictured):
    (frame, _), found = pictured
    eyes = of(found, "eyes", 0.9)
    assert 30 < eyes.sum() < 600
    assert np.abs(found.bare - found.seen)[eyes].max() < 0.05, "below hair and clothes they are as they are seen"
    white, blue = (eyes & (found.seen.min(-1) > 0.3), eyes & (found.seen[..., 2] > 2 * found.seen[..., 0]))
    assert white.sum() > 8 and blue.sum() > 8
    assert frame[white].mean() > 2 * frame[blue].mean() and (frame[blue].mean(0)[2] > 1.15 * frame[blue].mean(0)[0])


def test_a_camera_that_goes_with_the_head_sees_the_same(pictured):
    (still, moved), _ = pictured
    assert np.abs(still - moved).mean() < 0.01
    assert np.abs(still[:, 5:] - moved[:, :-5]).mean() > 0.02, "five pixels are a difference"
