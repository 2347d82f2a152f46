# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures as a texture holds them, and detail finer than the texture: taken from frames that hold it, shrunk by what the
views disagree on."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from core.capture.messages import Reporter
from core.imaging import images
from core.stages.texture.detail import fine_detail, finer
from core.stages.texture.held_picture import MARGIN_PX, hold, read_held
from core.stages.texture.projection import UnwrappedView
from core.stages.upscale.detail import guide

SIZE = 64
QUIET = Reporter("texture")
HEAD = SimpleNamespace(covered=np.ones((SIZE, SIZE), bool))


def seen_flat(log_luminance: np.ndarray, density: float, weight: float = 1.0) -> UnwrappedView:
    """A view that looks straight at the map: `density` pixels per texel, its picture the exponential of log_luminance
    [density S, density S]."""
    picture = hold(np.repeat(np.exp(log_luminance - 1.5)[..., None], 3, 2))
    at = ((np.arange(SIZE) + 0.5) * density).astype(np.float32)
    pixels = np.stack(np.meshgrid(at, at), -1)
    even = np.full((SIZE, SIZE), weight, np.float32)
    return UnwrappedView(SimpleNamespace(name="a view"), picture, pixels, picture.log_colours(pixels), even, even)


def pattern(size: int, deviation: float, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, deviation, (size, size)).astype(np.float32)


@pytest.mark.parametrize(("density", "factor"), [(0.5, 1), (1.2, 1), (1.5, 2), (2.0, 2), (3.0, 4)])
def test_the_frames_tell_how_fine_a_map_they_fill(density, factor):
    flat = np.zeros((int(SIZE * density),) * 2, np.float32)
    assert finer([seen_flat(flat, density)], SIZE) == factor


def test_frames_without_more_detail_leave_none():
    flat = np.zeros((SIZE, SIZE), np.float32)
    assert fine_detail([seen_flat(flat, 1.0)] * 3, HEAD, SIZE, QUIET) is None
    # one view: nobody to agree with
    assert fine_detail([seen_flat(np.zeros((2 * SIZE, 2 * SIZE), np.float32), 2.0)], HEAD, SIZE, QUIET) is None


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.3])
def test_what_views_agree_on_is_kept_and_what_they_do_not_is_shrunk(noise):
    """Wiener: of a band of power s^2 seen by V views with noise n^2 each, the share s^2 / (s^2 + n^2 / V)."""
    skin, views = pattern(2 * SIZE, 0.1, 0), 6
    observations = [seen_flat(skin + pattern(2 * SIZE, noise, 1 + i), 2.0) for i in range(views)]
    band, agreed = np.moveaxis(fine_detail(observations, HEAD, SIZE, QUIET), -1, 0)
    inner = np.s_[16:-16, 16:-16]
    expected = 0.1**2 / (0.1**2 + noise**2 / views)
    assert abs(agreed[inner].mean() - expected) < 0.08
    true = (skin - cv2.GaussianBlur(skin, (0, 0), 2.0))[inner]
    slope = (band[inner] * true).sum() / (true**2).sum()
    assert abs(slope - expected) < 0.1
    assert np.abs(band[inner] - true).std() < 1.05 * np.sqrt(1 - expected) * true.std() + 0.005


def test_the_band_takes_the_place_of_what_was_made_up():
    """Where it is certain the albedo has the frames' band and its own coarse rest; where it is not, it stays."""
    size = 128
    true, invented = pattern(size, 0.1, 3), pattern(size, 0.1, 4)
    coarse = cv2.GaussianBlur(pattern(size, 2.0, 5), (0, 0), 12) - 1.5
    sigma = size / 32
    bands = [x - cv2.GaussianBlur(x, (0, 0), sigma) for x in (true, invented)]
    albedo = images.linear_to_srgb(np.repeat(np.exp(coarse + bands[1])[..., None], 3, 2)).astype(np.float32)
    before = albedo.copy()
    certain = np.zeros((size, size), np.float32)
    certain[:, size // 2 :] = 1
    guide(albedo, np.stack([bands[0] * certain, certain], -1), 32, lambda done: None)
    assert np.abs(albedo - before)[:, : size // 2].max() < 1e-5
    log = np.log(images.srgb_to_linear(albedo)).mean(-1)[16:-16, size // 2 + 16 : -16]
    there = np.s_[16:-16, size // 2 + 16 : -16]
    got = (log - coarse[there]).ravel()
    like_first, like_second = (np.corrcoef(got, bands[k][there].ravel())[0, 1] for k in (0, 1))
    assert like_first > 0.97 and abs(like_second) < 0.2


WHOLE = slice(0, 256), slice(0, 256)


@pytest.mark.parametrize(("ending", "bits"), [("png", 8), ("png", 16), ("jpg", 8), ("exr", 16)])
def test_every_level_that_a_file_can_hold_is_read_as_it_is_from_the_file(tmp_path, ending, bits):
    levels = np.arange(65536, dtype=np.float32).reshape(256, 256) / 65535
    picture = np.stack([levels, levels[::-1], levels.T], -1)
    path = tmp_path / f"levels.{ending}"
    if ending == "exr":
        images.write_linear(path, 4 * picture)
    else:
        images.write_srgb(path, picture, bits=bits)
    held, linear = read_held(path), images.read_linear(path)
    assert np.array_equal(held.linear(*WHOLE), linear)
    assert held.stored.itemsize == (4 if ending == "exr" else bits // 8) and held.shape == (256, 256)
    gain = np.array([0.2, -0.1, 0.03])
    brighter = (linear * np.exp(gain)).astype(np.float32)
    for picture in (held, hold(linear)):
        assert np.array_equal(picture.brightened(gain).linear(*WHOLE), brighter)


def test_of_a_picture_no_more_is_kept_than_the_head_with_a_margin_and_there_nothing_changes(tmp_path):
    """A head 100 pixels wide and 60 high in a picture of 256: (100 + 16) x (60 + 16) pixels of two bytes a channel."""
    path = tmp_path / "frame.png"
    images.write_srgb(path, np.random.default_rng(0).random((256, 256, 3), np.float32), bits=16)
    whole = read_held(path)
    pixels = np.stack(np.meshgrid(np.linspace(90, 190, 41), np.linspace(20, 80, 41)), -1).astype(np.float32)
    part = whole.around(pixels)
    assert part.stored.nbytes == (100 + 2 * MARGIN_PX) * (60 + 2 * MARGIN_PX) * 3 * 2
    assert part.stored.base is None, "a view of the whole would keep the whole"
    assert np.array_equal(part.log_colours(pixels), whole.log_colours(pixels)) and part.shape == (256, 256)
    assert np.array_equal(part.linear(slice(16, 84), slice(86, 194)), whole.linear(slice(16, 84), slice(86, 194)))


def test_a_head_that_leaves_the_picture_is_held_up_to_its_border():
    whole = hold(np.random.default_rng(0).random((40, 30, 3), np.float32))
    pixels = np.float32([[[-20, 35], [12, 90]]])
    part = whole.around(pixels)
    assert part.corner == (0, 27) and part.stored.shape == (13, 20, 3)
    assert np.array_equal(part.log_colours(pixels), whole.log_colours(pixels)), "the border repeats, as it did"
    beside = whole.around(np.float32([[[-50, -50], [-40, -60]]]))
    assert beside.stored.shape == (1, 1, 3), "one that is not seen at all holds a pixel"
