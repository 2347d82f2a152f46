# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers over maps: what no layer covers keeps its bits, what one covers is what was painted, at any size of either."""

import numpy as np
import pytest

from core.imaging import images
from core.imaging.layers import lay_over, read_layer, resize_layer
from tests.fixtures.refused import refused

SIZE = 1024
RED = (0.6, 0.2, 0.1)


@pytest.fixture
def below() -> np.ndarray:
    return np.random.default_rng(0).uniform(0.4, 0.5, (SIZE, SIZE, 3)).astype(np.float32)


def patch(size: int, colour=RED, cover: float = 1.0) -> np.ndarray:
    """A layer that covers the middle quarter's rows and columns."""
    layer = np.zeros((size, size, 4), np.float32)
    layer[size // 4 : size // 2, size // 4 : size // 2] = (*colour, cover)
    return layer


@pytest.mark.parametrize("size", [256, 512, 1024, 2048])
def test_what_is_covered_is_as_painted_and_the_rest_as_it_was_to_the_last_bit(below, size):
    result, cover = lay_over(below, patch(size))
    inside, outside = np.s_[SIZE // 4 + 8 : SIZE // 2 - 8], cover == 0
    assert np.array_equal(result[outside], below[outside])
    assert np.abs(result[inside, inside].mean((0, 1)) - RED).max() < 2e-3
    reach = SIZE // size if size < SIZE else 0
    assert not cover[: SIZE // 4 - reach].any() and not cover[SIZE // 2 + reach :].any()
    assert (cover[inside, inside] == 1).all()


def test_a_smaller_layer_keeps_the_detail_that_is_finer_than_its_texels(below):
    inside = np.s_[SIZE // 4 + 8 : SIZE // 2 - 8, SIZE // 4 + 8 : SIZE // 2 - 8]
    small, full = (lay_over(below, patch(size))[0][inside] for size in (256, SIZE))
    assert 0.9 < small[..., 0].std(dtype=float) / below[inside][..., 0].std(dtype=float) < 1.02
    assert np.ptp(full, (0, 1)).max() < 1e-6


def test_opacity_order_and_alpha_work_as_in_a_paint_program(below):
    half = lay_over(below, patch(SIZE), 0.5)[0][300, 300]
    assert np.allclose(half, (below[300, 300] + RED) / 2, atol=1e-6)
    assert np.allclose(half, lay_over(below, patch(SIZE, cover=0.5))[0][300, 300], atol=1e-6)
    upper = patch(SIZE, (0.1, 0.1, 0.9), 0.25)
    both = lay_over(lay_over(below, patch(SIZE))[0], upper)[0][300, 300]
    assert np.allclose(both, np.add(np.multiply(RED, 0.75), np.multiply((0.1, 0.1, 0.9), 0.25)), atol=1e-6)


@pytest.mark.parametrize("size", [300, 512, 4096])
def test_no_colour_comes_in_from_where_a_layer_is_clear(size):
    layer = resize_layer(patch(1024), size)
    assert np.abs(layer[layer[..., 3] > 1e-3][:, :3] - RED).max() < 1e-3 and layer[..., 3].max() <= 1


def test_a_specular_map_takes_a_grey_layer():
    result, _ = lay_over(np.full((SIZE, SIZE, 1), 0.25, np.float32), patch(SIZE, (0.5, 0.5, 0.5)))
    assert result.shape == (SIZE, SIZE, 1) and np.isclose(result[300, 300], 0.5) and np.isclose(result[0, 0], 0.25)


def test_colours_are_read_as_they_are_where_they_are_nearly_clear(tmp_path):
    images.write_packed(tmp_path / "a.png", patch(256, cover=0.02), bits=16, srgb=True)
    layer = read_layer(tmp_path / "a.png")
    assert np.abs(layer[100, 100] - (*RED, 0.02)).max() < 1e-4


def test_what_is_no_layer_is_refused_by_name(tmp_path):
    images.write_packed(tmp_path / "long.png", np.zeros((256, 300, 4), np.float32))
    refused(lambda: read_layer(tmp_path / "long.png"), "long.png", "300 x 256", "square")
    images.write_srgb(tmp_path / "whole.png", np.zeros((256, 256, 3), np.float32))
    refused(lambda: read_layer(tmp_path / "whole.png"), "whole.png", "no alpha")
    images.write_packed(tmp_path / "small.png", np.zeros((32, 32, 4), np.float32))
    refused(lambda: read_layer(tmp_path / "small.png"), "small.png", "32 x 32")
    (tmp_path / "cut.png").write_bytes((tmp_path / "long.png").read_bytes()[:200])
    refused(lambda: read_layer(tmp_path / "cut.png"), "cut.png")
