# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The face parser: its crop maps back, its shares add up to one, and it knows the parts of somebody it has never
seen."""

import numpy as np
import pytest
import torch

from core.face import parser, template
from core.face.parser_network import ParseNet, network_input
from core.face.parts import BRIDGE, CHIN, PARTS, SIDE_PX, cut, inside, keep_beard, put_back, to_crop
from core.geometry.meshes import vertex_uvs
from research.benchmarks.head import parts as benchmark
from research.people.lifelike import snapshot, unlit
from tests.core.face.conftest import PARSER_VIEWS, TINY

SKIN, HAIR, BEARD, BACKGROUND = (PARTS.index(name) for name in ("skin", "hair", "beard", "background"))


@pytest.fixture(scope="module")
def sight(parser_work):
    return unlit.load(parser_work / "figure_1000" / "0.npz")


@pytest.fixture(scope="module")
def network():
    torch.manual_seed(0)
    network = ParseNet(**TINY)
    for weight in network.parameters():
        torch.nn.init.normal_(weight, std=0.2)
    return network.eval()


def landmarks(turn: float = 0.0, size: float = 100.0, middle: tuple[float, float] = (150.0, 120.0)) -> np.ndarray:
    """468 landmarks in an ellipse of this height, turned by degrees."""
    points = np.random.default_rng(0).uniform(-0.3, 0.3, (468, 2)) * size
    points[[BRIDGE, CHIN, 10]] = [[0, -0.2 * size], [0, 0.5 * size], [0, -0.5 * size]]
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    return np.concatenate([points @ np.array([[c, s], [-s, c]]) + middle, np.zeros((468, 1))], 1).astype(np.float32)


@pytest.mark.parametrize("turn", [0.0, -75.0])
def test_a_crop_is_upright_and_maps_back_to_its_pixels(turn):
    points = landmarks(turn)
    move = to_crop(points)
    chin, bridge = points[[CHIN, BRIDGE], :2] @ move[:, :2].T + move[:, 2]
    assert chin[0] == pytest.approx(bridge[0], abs=1e-3) and chin[1] > bridge[1]
    y, x = np.mgrid[0:240, 0:300] + 0.5
    smooth = np.stack([x, y], -1).astype(np.float32)  # a picture of where each pixel is
    crop = cut(smooth, move)
    v, u = np.mgrid[0:SIDE_PX, 0:SIDE_PX] + 0.5
    where = (np.stack([u, v], -1) - move[:, 2]) @ np.linalg.inv(move[:, :2]).T
    inner = (inside(smooth.shape, move) > 0.5) & (where > 2).all(-1) & (where < [298, 238]).all(-1)
    assert inner.mean() > 0.5 and np.abs(crop - where)[inner].max() < 0.06, "cv2 counts a 32nd of a pixel"
    again = np.stack([put_back(crop[..., k], move, smooth.shape, -1.0) for k in range(2)], -1)
    at = smooth @ move[:, :2].T + move[:, 2]
    within = (at > 2).all(-1) & (at < SIDE_PX - 2).all(-1) & (smooth > 4).all(-1) & (smooth < [296, 236]).all(-1)
    assert np.abs(again - smooth)[within].max() < 0.15
    assert (again[((at < -2) | (at > SIDE_PX + 2)).any(-1)] == -1).all()


def test_a_face_at_the_crops_own_scale_comes_back_exactly():
    move = to_crop(landmarks(size=SIDE_PX / 1.9, middle=(140.0, 130.0)))
    move[:, :2], move[:, 2] = np.eye(2), np.round(move[:, 2])
    picture = np.random.default_rng(1).random((260, 280)).astype(np.float32)
    again = put_back(cut(picture, move), move, picture.shape, -1.0)
    found = again != -1
    assert found.sum() == inside(picture.shape, move).sum() and np.array_equal(again[found], picture[found])


def test_shares_add_up_to_one_and_beyond_the_crop_is_background(network):
    srgb = np.random.default_rng(2).random((240, 300, 3)).astype(np.float32)
    found = parser.parse(srgb, landmarks(20.0, 60.0), network)
    whole = found.picture()
    assert whole.shape == (240, 300, len(PARTS)) and whole.dtype == np.float32 and whole.min() >= 0
    assert np.abs(whole.sum(-1) - 1).max() < 1e-4 and found.crop[..., 0].std() > 0.01
    assert (whole[0, 0] == np.eye(len(PARTS))[BACKGROUND]).all()
    assert np.allclose(found.of("hair", "beard"), whole[..., HAIR] + whole[..., BEARD], atol=1e-5)


def test_a_mirrored_picture_has_mirrored_parts(network):
    points = landmarks(0.0, SIDE_PX / 1.9, (120.0, 110.0))
    picture = np.random.default_rng(3).random((220, 240, 3)).astype(np.float32)
    one = parser.parse(picture, points, network)
    other = parser.parse(picture[:, ::-1], points * [-1, 1, 1] + [240, 0, 0], network)
    assert np.abs(one.picture() - other.picture()[:, ::-1]).max() < 0.02


def test_dark_pictures_are_seen_as_bright_ones():
    picture = np.random.default_rng(4).uniform(0, 0.8, (SIDE_PX, SIDE_PX, 3)).astype(np.float32)
    known = np.ones((SIDE_PX, SIDE_PX), np.float32)
    assert np.abs(network_input(picture, known) - network_input(picture / 4, known)).max() < 1e-4
    known[:40] = 0
    layers = network_input(picture, known)
    assert (layers[:, :40] == 0).all() and (layers[3, 40:] == 1).all()


def test_a_sight_knows_what_grows_where(sight):
    shares = sight.shares.astype(np.float32) / 255
    assert np.abs(shares.sum(-1) - 1).max() < 0.02
    x, y = np.floor(sight.landmarks[CHIN]).astype(int)
    assert shares[y - 4 : y, x - 2 : x + 3, BEARD].mean() > 0.5, "a full beard covers the chin, roots and all"
    assert shares[:60, 0, BACKGROUND].mean() > 0.9 and shares[..., HAIR].max() > 0.9
    assert sight.reach.max() == 255 and 40 < np.median(sight.free[shares[..., SKIN] > 0.9]) <= 255


def test_the_shipped_network_knows_the_parts_of_somebody_it_never_saw(parser_work):
    """A bearded man with cropped hair, by other lights than its own, from two sides."""
    hit = np.zeros((len(PARTS), 2))
    for view in range(PARSER_VIEWS):
        sight = unlit.load(parser_work / "figure_9000" / f"{view}.npz")
        srgb, shares = snapshot.photograph(sight, np.random.default_rng([5, view]))
        found = parser.parse(srgb, sight.landmarks)
        true, known = cut(shares, found.move).argmax(-1), inside(srgb.shape, found.move) > 0.5
        for k in range(len(PARTS)):
            hit[k] += [((true == k) & (found.crop.argmax(-1) == k) & known).sum(), ((true == k) & known).sum()]
    right = hit[:, 0] / np.maximum(hit[:, 1], 1)
    assert right[[SKIN, HAIR, BACKGROUND]].min() > 0.6 and hit[:, 0].sum() / hit[:, 1].sum() > 0.75, right


def test_the_figures_of_a_row_are_those_counted_by_hand():
    truth = np.full((20, 20), BACKGROUND)
    truth[:10], truth[:5] = SKIN, HAIR
    found = truth.copy()
    found[:2] = SKIN  # two rows of hair taken for skin
    row = benchmark.row([(truth, found, np.ones((20, 20), bool))], 2)
    assert row["pictures"] == 2 and row["found"] == 1 and row["hair_as_skin"] == 0.4 and row["skin_as_hair"] == 0.0
    iou = row["iou"]
    assert (iou["hair"], iou["background"], iou["beard"]) == (0.6, 1.0, None)
    assert iou["skin"] == pytest.approx(100 / 140)


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
