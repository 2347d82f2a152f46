# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How much memory a view's picture takes, and that what is read of it is what its file says."""

import numpy as np
import pytest

from core.imaging import images
from core.stages.texture.held_picture import MARGIN_PX, hold, read_held

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
