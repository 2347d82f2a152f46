# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The face parser: its crop maps back, its shares add up, it learns from synthetic people that nothing is measured on,
and goes on where it was killed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from core.capture.messages import Problem, Reporter
from core.face import parser, template
from core.face.parser_network import ParseNet, network_input
from core.face.parts import BRIDGE, CHIN, PARTS, SIDE_PX, cut, inside, keep_beard, put_back, to_crop
from core.geometry.meshes import vertex_uvs
from research.benchmarks import parts as benchmark
from research.people.identities import reserved_seeds
from research.people.lifelike import figure, snapshot, unlit
from research.training import descent, snapshots
from research.training import parser as training
from research.training.descent import TrainingRun
from research.training.seeds import named_subjects

QUIET = Reporter("train", emit=lambda message: None)
SEED, VIEWS = 3, 2  # a man with cropped hair, a full beard and open eyes
TINY = {"widths": [8, 8, 8, 8], "depths": [1, 1, 1, 1]}


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    """A training's folder with two figures' sights, one of them held out."""
    folder = tmp_path_factory.mktemp("parser")
    scene = unlit.scene_of(figure.make_figure(SEED, 256), np.random.default_rng(0))
    for seed in (1000, 9000):
        for view in range(VIEWS):
            rng = np.random.default_rng([seed, view])
            (folder / f"figure_{seed}").mkdir(exist_ok=True)
            unlit.save(
                folder / f"figure_{seed}" / f"{view}.npz",
                unlit.trace_unlit(scene, unlit.random_view(scene.figure, rng), rng),
            )
    return folder


@pytest.fixture(scope="module")
def sight(work):
    return unlit.load(work / "figure_1000" / "0.npz")


def landmarks(turn: float = 0.0, size: float = 100.0, middle: tuple[float, float] = (150.0, 120.0)) -> np.ndarray:
    """468 landmarks in an ellipse of this height, turned by degrees."""
    points = np.random.default_rng(0).uniform(-0.3, 0.3, (468, 2)) * size
    points[[BRIDGE, CHIN]] = [[0, -0.2 * size], [0, 0.5 * size]]
    points[10] = [0, -0.5 * size]
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    return np.concatenate([points @ np.array([[c, s], [-s, c]]) + middle, np.zeros((468, 1))], 1).astype(np.float32)


def randomly(network: ParseNet) -> ParseNet:
    torch.manual_seed(0)
    for weight in network.parameters():
        torch.nn.init.normal_(weight, std=0.2)
    return network.eval()


@pytest.mark.parametrize("turn", [0.0, 30.0, -75.0])
def test_a_crop_is_upright_and_maps_back_to_its_pixels(turn):
    points = landmarks(turn)
    move = to_crop(points)
    chin, bridge = points[[CHIN, BRIDGE], :2] @ move[:, :2].T + move[:, 2]
    assert chin[0] == pytest.approx(bridge[0], abs=1e-3) and chin[1] > bridge[1]
    y, x = np.mgrid[0:240, 0:300] + 0.5
    smooth = np.stack([x, y], -1).astype(np.float32)  # a picture of where each pixel is
    crop = cut(smooth, move)
    known = inside(smooth.shape, move) > 0.5
    v, u = np.mgrid[0:SIDE_PX, 0:SIDE_PX] + 0.5
    where = (np.stack([u, v], -1) - move[:, 2]) @ np.linalg.inv(move[:, :2]).T
    inner = known & (where > 2).all(-1) & (where < [298, 238]).all(-1)
    assert inner.mean() > 0.5 and np.abs(crop - where)[inner].max() < 0.06, "cv2 counts a 32nd of a pixel"
    again = np.stack([put_back(crop[..., k], move, smooth.shape, -1.0) for k in range(2)], -1)
    at = smooth @ move[:, :2].T + move[:, 2]
    within = (at > 2).all(-1) & (at < SIDE_PX - 2).all(-1) & (smooth > 4).all(-1) & (smooth < [296, 236]).all(-1)
    assert np.abs(again - smooth)[within].max() < 0.15
    assert (again[((at < -2) | (at > SIDE_PX + 2)).any(-1)] == -1).all()


def test_a_face_at_the_crops_own_scale_comes_back_exactly():
    points = landmarks(size=SIDE_PX / 1.9, middle=(140.0, 130.0))
    move = to_crop(points)
    move[:, :2], move[:, 2] = np.eye(2), np.round(move[:, 2])
    picture = np.random.default_rng(1).random((260, 280)).astype(np.float32)
    again = put_back(cut(picture, move), move, picture.shape, -1.0)
    found = again != -1
    assert found.sum() == inside(picture.shape, move).sum() and np.array_equal(again[found], picture[found])


def test_shares_add_up_to_one_and_beyond_the_crop_is_background():
    rng, points = np.random.default_rng(2), landmarks(20.0, 60.0)
    found = parser.parse(rng.random((240, 300, 3)).astype(np.float32), points, randomly(ParseNet(**TINY)))
    whole = found.picture()
    assert whole.shape == (240, 300, len(PARTS)) and whole.dtype == np.float32 and whole.min() >= 0
    assert np.abs(whole.sum(-1) - 1).max() < 1e-4 and found.crop[..., 0].std() > 0.01
    assert (whole[0, 0] == np.eye(len(PARTS))[PARTS.index("background")]).all()
    assert np.allclose(
        found.of("hair", "beard"), whole[..., PARTS.index("hair")] + whole[..., PARTS.index("beard")], atol=1e-5
    )


def test_a_mirrored_picture_has_mirrored_parts():
    rng, points = np.random.default_rng(3), landmarks(0.0, SIDE_PX / 1.9, (120.0, 110.0))
    picture, network = rng.random((220, 240, 3)).astype(np.float32), randomly(ParseNet(**TINY))
    mirrored = points * [-1, 1, 1] + [240, 0, 0]
    one, other = parser.parse(picture, points, network), parser.parse(picture[:, ::-1], mirrored, network)
    assert np.abs(one.picture() - other.picture()[:, ::-1]).max() < 0.02


def test_dark_pictures_are_seen_as_bright_ones():
    picture = np.random.default_rng(4).uniform(0, 0.8, (SIDE_PX, SIDE_PX, 3)).astype(np.float32)
    known = np.ones((SIDE_PX, SIDE_PX), np.float32)
    assert np.abs(network_input(picture, known) - network_input(picture / 4, known)).max() < 1e-4
    known[:40] = 0
    layers = network_input(picture, known)
    assert (layers[:, :40] == 0).all() and (layers[3, 40:] == 1).all()


def test_missing_weights_are_a_problem(tmp_path):
    with pytest.raises(Problem, match="weights of the face parser are missing"):
        parser.load(tmp_path / "parser.safetensors")


def test_a_sight_knows_what_grows_where(sight):
    shares = sight.shares.astype(np.float32) / 255
    assert np.abs(shares.sum(-1) - 1).max() < 0.02
    points = np.floor(sight.landmarks).astype(int)
    named = {name: shares[..., PARTS.index(name)] for name in PARTS}
    x, y = points[CHIN]
    assert named["beard"][y - 4 : y, x - 2 : x + 3].mean() > 0.5, "a full beard covers the chin, roots and all"
    assert named["background"][:, 0][:60].mean() > 0.9 and named["hair"].max() > 0.9
    assert sight.reach.max() == 255 and 40 < np.median(sight.free[named["skin"] > 0.9]) <= 255


def test_a_photograph_keeps_its_parts_whatever_its_colours(sight):
    plain = sight.shares.astype(np.float32) / 255
    uncovered = replace(sight, shares=sight.shares)
    pictures = [snapshot.photograph(uncovered, np.random.default_rng(seed)) for seed in range(6)]
    again = snapshot.photograph(sight, np.random.default_rng(5))
    assert np.array_equal(pictures[5][0], again[0]) and np.array_equal(pictures[5][1], again[1])
    for srgb, shares in pictures:
        assert (
            srgb.shape == shares.shape[:2] + (3,)
            and 0 <= srgb.min()
            and srgb.max() <= 1
            and np.abs(shares.sum(-1) - 1).max() < 0.02
        )
        lost = plain[..., :-1].sum(-1) - shares[..., :-1].sum(-1)
        assert lost.min() > -0.02, "what covers a person is background: no part grows beyond its owner"
    tones = np.array([srgb[plain[..., PARTS.index("skin")] > 0.95].mean(0) for srgb, _ in pictures])
    assert tones.std(0).min() > 0.03


def test_the_shipped_network_knows_the_parts_of_somebody_it_never_saw(work):
    """A bearded man with cropped hair, by other lights than its own, from two sides."""
    hit = np.zeros((len(PARTS), 2))
    for view in range(VIEWS):
        sight = unlit.load(work / "figure_9000" / f"{view}.npz")
        srgb, shares = snapshot.photograph(sight, np.random.default_rng([5, view]))
        found = parser.parse(srgb, sight.landmarks)
        true, known = cut(shares, found.move).argmax(-1), inside(srgb.shape, found.move) > 0.5
        for k in range(len(PARTS)):
            hit[k] += [((true == k) & (found.crop.argmax(-1) == k) & known).sum(), ((true == k) & known).sum()]
    right = dict(zip(PARTS, hit[:, 0] / np.maximum(hit[:, 1], 1), strict=True))
    assert all(right[name] > 0.6 for name in ("skin", "hair", "background")), right
    assert hit[:, 0].sum() / hit[:, 1].sum() > 0.75, right


def test_nothing_is_learnt_from_people_that_are_measured():
    for config in training.CONFIGS.values():
        named = named_subjects(config["training"]["figures"], config["training"]["held_out"])
        assert len(set(named["seeds"])) == config["training"]["figures"] and not set(named["seeds"]) & set(
            named["held_out_seeds"]
        )
        assert not (set(named["seeds"]) | set(named["held_out_seeds"])) & reserved_seeds()
    assert {person.seed for person in benchmark.LIKENESSES} <= reserved_seeds()


def test_a_little_training_beats_the_constant_answer(work):
    """Of a photograph's parts, whose shares the constant answer even knows."""
    batch = snapshots.Snapshots([1000], VIEWS, work, None).draw(2, 1, np.random.default_rng(0))[0]
    torch.manual_seed(0)
    network = ParseNet(**TINY)
    weight = batch.known * (
        1
        + training.NEAR
        * torch.nn.functional.max_pool2d(
            batch.shares[:, [PARTS.index(n) for n in training.SMALL]].sum(1, keepdim=True),
            2 * training.REACH + 1,
            1,
            training.REACH,
        )
    )
    usual = (batch.shares * weight).sum((0, 2, 3)) / weight.sum()
    constant = -float((usual * usual.clamp_min(1e-9).log()).sum())
    optimiser = torch.optim.AdamW(network.parameters(), lr=1e-2)
    for _ in range(60):  # at most
        value = training.loss(network, batch, "cpu")
        optimiser.zero_grad()
        value.backward()
        optimiser.step()
        if value.item() < 0.6 * constant:
            break
    assert value.item() < 0.6 * constant


def test_a_killed_training_goes_on_to_the_same_weights(work, tmp_path, monkeypatch):
    options = training.CONFIGS["cpu"]["training"] | {"batch": 1, "echo": 2, "figures": 1, "held_out": 1, "views": VIEWS}
    monkeypatch.setitem(training.CONFIGS, "cpu", {"model": TINY, "training": options})
    ticks = iter(range(10**6))
    # a step takes 40 s by the training's clock
    monkeypatch.setattr(descent, "time", SimpleNamespace(monotonic=lambda: 40.0 * next(ticks)))
    weights = []
    for kill in (None, 12):
        folder = tmp_path / str(kill)
        folder.mkdir()
        for figure_folder in work.glob("figure_*"):
            (folder / figure_folder.name).symlink_to(figure_folder)
        steps = []

        def counted(network, batch, device, steps=steps, kill=kill, loss=training.loss):
            steps.append(1)
            if len(steps) == kill:
                raise KeyboardInterrupt
            return loss(network, batch, device)

        with monkeypatch.context() as patched:
            patched.setattr(training, "loss", counted)
            if kill:
                with pytest.raises(KeyboardInterrupt):
                    training.train_parser("cpu", folder / "parser.safetensors", QUIET, TrainingRun(12, folder))
            card = training.train_parser("cpu", folder / "parser.safetensors", QUIET, TrainingRun(12, folder))
        weights.append(
            {name: value.clone() for name, value in parser.load(folder / "parser.safetensors").state_dict().items()}
        )
    assert card["steps"] == 18 and card["prepared"] == 1 and set(PARTS) < set(card["held_out"]), card
    assert all(torch.equal(weights[0][name], weights[1][name]) for name in weights[0])
    with pytest.raises(Problem, match="other data"):
        monkeypatch.setitem(options, "figures", 2)
        training.train_parser("cpu", folder / "parser.safetensors", QUIET, TrainingRun(12, folder, growing=True))


def test_growing_needs_figures(tmp_path):
    with pytest.raises(Problem, match="There are no figures"):
        training.train_parser(
            "cpu", tmp_path / "parser.safetensors", QUIET, TrainingRun(1, tmp_path / "work", growing=True)
        )


def test_the_figures_of_a_row_are_those_counted_by_hand():
    skin, hair, back = (PARTS.index(name) for name in ("skin", "hair", "background"))
    truth = np.full((20, 20), back)
    truth[:10], truth[:5] = skin, hair
    found = truth.copy()
    found[:2] = skin  # two rows of hair taken for skin
    row = benchmark.row([(truth, found, np.ones((20, 20), bool))], 2)
    assert row["pictures"] == 2 and row["found"] == 1 and row["hair_as_skin"] == 0.4 and row["skin_as_hair"] == 0.0
    assert (
        row["iou"]["hair"] == 0.6
        and row["iou"]["skin"] == pytest.approx(100 / 140)
        and row["iou"]["background"] == 1.0
        and row["iou"]["beard"] is None
    )


def test_a_beard_is_believed_where_both_sides_of_the_face_say_so():
    left, right, both_seen = np.array([0.7, 0.6, 0.0]), np.array([0.6, 0.5, 0.0]), np.ones(3, bool)
    assert np.array_equal(keep_beard(left, right, both_seen), left), "more likely than not on both: 0.55 in the mean"
    shadow = np.array([0.95, 0.9, 0.0])
    assert not keep_beard(shadow, 0 * shadow, both_seen).any(), "sure, but on one side alone"
    assert not keep_beard(left, right, ~both_seen).any(), "a profile that is not sure"
    assert np.array_equal(keep_beard(shadow, 0 * shadow, ~both_seen), shadow), "a profile that is"


def test_the_head_and_its_uvs_are_their_own_mirror_image():
    head, mirror = template.load(), template.mirrored_vertices()
    assert np.abs(head.vertices[mirror] - head.vertices * [-1, 1, 1]).max() < 1e-6
    assert np.array_equal(mirror[mirror], np.arange(len(mirror)))
    uvs = vertex_uvs(head)
    off = np.abs(uvs[mirror] + uvs * [1, -1] - [1, 0]).max(1)
    assert (off < 1e-6).mean() > 0.99, "all but the seam behind"
