# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The eye reader: eyes of either side come upright, sights know white and iris, it learns from them and from nobody
that is measured, and sees eyes that it never saw."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from core.capture.messages import Problem, Reporter
from core.face import eye_reader
from core.face.eye_reader import SIDE_PX
from core.face.parser_network import ParseNet
from core.face.parts import cut
from research.people.identities import reserved_seeds
from research.people.lifelike import eye_sights, figure, unlit
from research.people.lifelike.person import sample_person
from research.training import descent
from research.training import eyes as training
from research.training.descent import TrainingRun

QUIET = Reporter("train", emit=lambda message: None)
SEED = 3
TINY = {"widths": [8, 8, 8, 8], "depths": [1, 1, 1, 1]}


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    """A training's folder with the sights of one pose of two figures, one of them held out."""
    folder = tmp_path_factory.mktemp("eyes")
    person = figure.make_figure(replace(sample_person(SEED), hair="none", beard="none", openness=0.9), 256)
    scene = unlit.scene_of(person, np.random.default_rng(0))
    for seed in (1000, 9000):
        (folder / f"figure_{seed}").mkdir()
        for view in range(training.VIEWS):
            eye_sights.save(
                folder / f"figure_{seed}" / f"{view}.npz",
                eye_sights.see_eye(scene, view % 2 == 1, np.random.default_rng([seed, view])),
            )
    return folder


@pytest.fixture(scope="module")
def sights(work):
    """A right and a left eye."""
    return [eye_sights.load(work / "figure_1000" / f"{view}.npz") for view in (0, 1)]


@pytest.fixture
def tiny(monkeypatch):
    options = training.CONFIGS["cpu"]["training"] | {"batch": 2, "echo": 2, "figures": 1, "held_out": 1, "poses": 1}
    monkeypatch.setitem(training.CONFIGS, "cpu", {"model": TINY, "training": options})
    return options


@pytest.mark.parametrize("turn", [0.0, 25.0, -70.0])
@pytest.mark.parametrize("left", [False, True])
def test_an_eye_comes_upright_with_its_outer_corner_to_the_left(turn, left):
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    down = np.array([-s, c])
    outer, inner = (np.array([200.0, 150.0]) + np.array([c, s]) * off for off in ((30, -30) if left else (-30, 30)))
    move = eye_reader.to_eye_crop(np.stack([outer, inner]), left)
    places = np.stack([outer, inner, (outer + inner) / 2 + 20 * down]) @ move[:, :2].T + move[:, 2]
    width = SIDE_PX / eye_reader.SPAN_EYE_WIDTHS
    assert np.allclose(
        places,
        [
            [SIDE_PX / 2 - width / 2, SIDE_PX / 2],
            [SIDE_PX / 2 + width / 2, SIDE_PX / 2],
            [SIDE_PX / 2, SIDE_PX / 2 + 20 * width / 60],
        ],
    )


def test_a_sight_knows_the_white_and_the_iris_of_the_eye_in_its_middle(sights):
    for sight, left in zip(sights, (False, True), strict=True):
        ball = sight.ball.astype(np.float32) / 255
        outer, inner = sight.corners
        assert sight.left is left and (outer[0] > inner[0]) == left
        assert np.abs((outer + inner) / 2 - eye_sights.SIZE / 2).max() < 1
        eyes = sight.unlit.shares[..., eye_sights.EYES] / 255.0
        assert (ball.sum(-1) <= eyes + 0.02).all(), "lashes are the eyes' in a sight, and not the ball's"
        near = np.linalg.norm(np.argwhere(ball[..., 1] > 0.5)[:, ::-1] + 0.5 - (outer + inner) / 2, axis=1)
        assert len(near) > 30 and near.max() < np.linalg.norm(outer - inner)


def test_a_photograph_keeps_the_opening_whatever_is_put_on_it(sights):
    plain = sights[0].ball.sum(-1) / 255.0
    pictures = [eye_sights.photograph_eye(sights[0], np.random.default_rng(seed)) for seed in range(8)]
    again = eye_sights.photograph_eye(sights[0], np.random.default_rng(7))
    assert all(np.array_equal(one, other) for one, other in zip(pictures[7], again, strict=True))
    for srgb, ball in pictures:
        assert srgb.shape == (eye_sights.SIZE, eye_sights.SIZE, 3) and 0 <= srgb.min() and srgb.max() <= 1
        assert ball.min() >= 0 and ball.sum(-1).max() < 1.01
    areas = [ball.sum() / plain.sum() for _, ball in pictures]
    assert 0.8 < np.median(areas) < 1.2 and max(areas) < 1.5
    irises = np.array([srgb[ball[..., 1] > 0.9].mean(0) for srgb, ball in pictures if (ball[..., 1] > 0.9).any()])
    assert irises.std(0).min() > 0.05


def test_an_example_is_a_right_eye(sights):
    """Of both sides: the outer corner lies to the left, and the shares lie where the picture has them."""
    for sight in sights:
        ball = sight.ball.astype(np.float32) / 255
        coded = np.concatenate([ball, ball[..., :1]], -1)  # a picture whose colours are its shares
        layers, shares = training.make_example(coded, ball, sight, np.random.default_rng(0), augment=False)
        assert layers.shape == (4, SIDE_PX, SIDE_PX) and shares.shape == (3, SIDE_PX, SIDE_PX)
        assert np.abs(shares.sum(0) - 1).max() < 0.005
        white = shares[1] > 0.9
        assert layers[0][white].min() > layers[0][shares[0] > 0.99].max()
        move = eye_reader.to_eye_crop(sight.corners, sight.left)
        outer, inner = sight.corners @ move[:, :2].T + move[:, 2]
        assert outer[0] < inner[0] and np.array_equal(cut(ball, move, SIDE_PX)[..., 0] > 0.9, white)


def test_nothing_is_learnt_from_people_that_are_measured():
    for config in training.CONFIGS.values():
        named = training.named_subjects(config["training"]["figures"], config["training"]["held_out"])
        assert not (set(named["seeds"]) | set(named["held_out_seeds"])) & reserved_seeds()


def test_the_shipped_reader_sees_eyes_that_it_never_saw(work):
    rng, both = np.random.default_rng(6), np.zeros((2, 2))
    for view in range(training.VIEWS):
        sight = eye_sights.load(work / "figure_9000" / f"{view}.npz")
        for _ in range(4):
            picture, ball = eye_sights.photograph_eye(sight, rng)
            found = eye_reader.read_eye(picture, sight.corners, sight.left)
            true = cut(ball, found.move, SIDE_PX)
            for k, (seen, there) in enumerate(((found.ball, true.sum(-1)), (found.iris, true[..., 1]))):
                both[k] += [((seen > 0.5) & (there > 0.5)).sum(), ((seen > 0.5) | (there > 0.5)).sum()]
    ball, iris = both[:, 0] / both[:, 1]
    assert ball > 0.65 and iris > 0.5, (ball, iris)


def test_missing_weights_are_a_problem(tmp_path):
    with pytest.raises(Problem, match="weights of the eye reader are missing"):
        eye_reader.load(tmp_path / "eyes.safetensors")


def test_growing_needs_figures(tmp_path):
    with pytest.raises(Problem, match="There are no figures"):
        training.train_eyes(
            "cpu", tmp_path / "eyes.safetensors", QUIET, TrainingRun(1, tmp_path / "work", growing=True)
        )


def test_a_little_training_beats_the_constant_answer(work, tiny):
    batch = training.Eyes([1000], 1, work, None).draw(4, 1, np.random.default_rng(0))[0]
    torch.manual_seed(0)
    network = ParseNet(**TINY, parts=len(eye_reader.CLASSES))
    optimiser, values = torch.optim.AdamW(network.parameters(), lr=1e-2), []
    for _ in range(40):
        values.append(training.loss(network, batch, "cpu"))
        optimiser.zero_grad()
        values[-1].backward()
        optimiser.step()
    constant = min(float(training.loss(_constant(share), batch, "cpu")) for share in np.linspace(0.02, 0.98, 25))
    assert values[-1].item() < 0.6 * constant


def _constant(share: float):
    """A network that says the same everywhere."""
    odds = torch.log(torch.tensor([share, (1 - share) / 2, (1 - share) / 2]))
    return lambda layers: odds[None, :, None, None].expand(len(layers), 3, SIDE_PX, SIDE_PX)


def test_a_training_ends_with_weights_that_read(work, tiny, tmp_path, monkeypatch, sights):
    folder = tmp_path / "run"
    folder.mkdir()
    for figure_folder in work.glob("figure_*"):
        (folder / figure_folder.name).symlink_to(figure_folder)
    ticks = iter(range(10**6))
    # a step takes 40 s by the training's clock
    monkeypatch.setattr(descent, "time", SimpleNamespace(monotonic=lambda: 40.0 * next(ticks)))
    out = folder / "eyes.safetensors"
    card = training.train_eyes("cpu", out, QUIET, TrainingRun(4, folder))
    assert card["steps"] == 6 and card["prepared"] == 1 and {"ball", "iris"} < set(card["held_out"]), card
    picture = eye_sights.photograph_eye(sights[0], np.random.default_rng(0))[0]
    seen = eye_reader.read_eye(picture, sights[0].corners, False, eye_reader.load(out))
    assert seen.ball.shape == (SIDE_PX, SIDE_PX) and 0 <= seen.ball.min() and (seen.iris <= seen.ball + 1e-6).all()
    with pytest.raises(Problem, match="other data"):
        monkeypatch.setitem(tiny, "figures", 2)
        training.train_eyes("cpu", out, QUIET, TrainingRun(4, folder, growing=True))


def test_a_figures_sights_are_made_once(tmp_path, tiny, monkeypatch):
    """Of the figures that the folder lacks, each pose with both eyes."""
    bald = figure.make_figure(replace(sample_person(SEED), hair="none", beard="none"), 128)
    made = []
    monkeypatch.setattr(training, "make_figure", lambda person, texels: made.append(1) or bald)
    training.prepare_figures("cpu", tmp_path, QUIET)
    training.prepare_figures("cpu", tmp_path, QUIET)
    assert len(made) == 2 and training.is_prepared(1000, 1, tmp_path) and training.is_prepared(9000, 1, tmp_path)
    assert [eye_sights.load(tmp_path / "figure_9000" / f"{view}.npz").left for view in range(4)] == [False, True] * 2
