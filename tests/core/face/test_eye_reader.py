# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The eye reader: eyes of either side come upright, its training pictures know white and iris, and it reads eyes it
has never seen."""

import numpy as np
import pytest

from core.face import eye_reader
from core.face.eye_reader import SIDE_PX
from core.face.parts import PARTS, cut
from research.people.lifelike import eye_sights
from research.training import eyes as training


@pytest.fixture(scope="module")
def sights(eyes_work):
    """A right and a left eye."""
    return [eye_sights.load(eyes_work / "figure_1000" / f"{view}.npz") for view in (0, 1)]


@pytest.mark.parametrize("turn", [0.0, -70.0])
@pytest.mark.parametrize("left", [False, True])
def test_an_eye_comes_upright_with_its_outer_corner_to_the_left(turn, left):
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    outer, inner = (np.array([200.0, 150.0]) + np.array([c, s]) * off for off in ((30, -30) if left else (-30, 30)))
    move = eye_reader.to_eye_crop(np.stack([outer, inner]), left)
    below = (outer + inner) / 2 + 20 * np.array([-s, c])
    half, width = SIDE_PX / 2, SIDE_PX / eye_reader.SPAN_EYE_WIDTHS
    expected = [[half - width / 2, half], [half + width / 2, half], [half, half + 20 * width / 60]]
    assert np.allclose(np.stack([outer, inner, below]) @ move[:, :2].T + move[:, 2], expected)


def test_a_sight_knows_the_white_and_the_iris_of_the_eye_in_its_middle(sights):
    for sight, left in zip(sights, (False, True), strict=True):
        ball = sight.ball.astype(np.float32) / 255
        outer, inner = sight.corners
        assert bool(sight.left) is left and (outer[0] > inner[0]) == left
        assert np.abs((outer + inner) / 2 - eye_sights.SIZE / 2).max() < 1
        eyes = sight.unlit.shares[..., PARTS.index("eyes")] / 255.0
        assert (ball.sum(-1) <= eyes + 0.02).all(), "lashes belong to the eyes but not to the ball"
        near = np.linalg.norm(np.argwhere(ball[..., 1] > 0.5)[:, ::-1] + 0.5 - (outer + inner) / 2, axis=1)
        assert len(near) > 30 and near.max() < np.linalg.norm(outer - inner)


def test_an_example_is_a_right_eye(sights):
    """The outer corner lies to the left, and the shares lie where the picture has them."""
    for sight in sights:
        ball = sight.ball.astype(np.float32) / 255
        coded = np.concatenate([ball, ball[..., :1]], -1)  # a picture whose colours are its shares
        layers, shares, _ = training.make_example(coded, ball, sight, np.random.default_rng(0), augment=False)
        assert np.abs(shares.sum(0) - 1).max() < 0.005
        white = shares[1] > 0.9
        assert layers[0][white].min() > layers[0][shares[0] > 0.99].max()
        move = eye_reader.to_eye_crop(sight.corners, sight.left)
        outer, inner = sight.corners @ move[:, :2].T + move[:, 2]
        assert outer[0] < inner[0] and np.array_equal(cut(ball, move, SIDE_PX)[..., 0] > 0.9, white)


def test_the_shipped_reader_sees_eyes_that_it_never_saw(eyes_work):
    rng, both = np.random.default_rng(6), np.zeros((2, 2))
    for view in range(training.VIEWS):
        sight = eye_sights.load(eyes_work / "figure_9000" / f"{view}.npz")
        for _ in range(3):
            picture, ball = eye_sights.photograph_eye(sight, rng)
            found = eye_reader.read_eye(picture, sight.corners, sight.left)
            assert 0 <= found.ball.min() and (found.iris <= found.ball + 1e-6).all()
            true = cut(ball, found.move, SIDE_PX)
            for k, (seen, there) in enumerate(((found.ball, true.sum(-1)), (found.iris, true[..., 1]))):
                both[k] += [((seen > 0.5) & (there > 0.5)).sum(), ((seen > 0.5) | (there > 0.5)).sum()]
    ball, iris = both[:, 0] / both[:, 1]
    assert ball > 0.65 and iris > 0.5, (ball, iris)
