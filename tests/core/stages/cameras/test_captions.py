# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Captions and logos over a film are masked; a film without any, and one of a camera that stands still, are not."""

import cv2
import numpy as np
import pytest

from core.capture.frame_records import FrameRecord
from core.imaging import images
from core.stages.cameras.captions import find_captions, write_masks

HEIGHT, WIDTH, COUNT = 240, 320, 36
SCENE = cv2.resize(
    np.random.default_rng(2).random((40, 240, 3), np.float32), (1440, 240), interpolation=cv2.INTER_CUBIC
)


def film(folder, step: int, text: str = "", opacity: float = 1.0, until: int = COUNT) -> list[FrameRecord]:
    """Write frames past which the scene moves by `step` pixels, with a text over the first `until`."""
    letters = np.zeros((HEIGHT, WIDTH, 1), np.float32)
    cv2.putText(letters, text, (30, 220), cv2.FONT_HERSHEY_SIMPLEX, 1.0, 1.0, 2, cv2.LINE_AA)
    records = []
    for i in range(COUNT):
        picture = np.clip(SCENE[:, step * i : step * i + WIDTH], 0, 1)
        picture = picture + (i < until) * opacity * letters * (1 - picture)
        images.write_srgb(folder / f"{i:05d}.jpg", picture.astype(np.float32), quality=95)
        size = {"name": f"{i:05d}.jpg", "size": (WIDTH, HEIGHT), "sharpness": 1.0, "selected": False}
        records.append(FrameRecord(**size))
    return records


@pytest.mark.parametrize("opacity", [1.0, 0.6])
def test_a_text_that_stays_is_masked_and_no_more_than_it(tmp_path, opacity):
    records = film(tmp_path, 23, "my new head", opacity)
    masks = find_captions(records, tmp_path)
    assert len(masks) == COUNT
    for mask in masks.values():
        rows, columns = np.nonzero(mask)
        assert mask[195:221, 35:220].mean() > 0.85 and rows.min() > 165 and 0 <= columns.min() < 40
    write_masks(masks, records, tmp_path)
    written = images.read_data(tmp_path / "00000.jpg.png")
    assert written.shape[:2] == (HEIGHT, WIDTH) and written[210, 100].max() == 0 and written[20, 100].min() == 1


def test_a_text_is_masked_only_where_it_stands(tmp_path):
    masks = find_captions(film(tmp_path, 23, "hello, hello", until=12), tmp_path)
    assert sorted(masks) == [f"{i:05d}.jpg" for i in range(12)]


@pytest.mark.parametrize("step", [23, 7, 0])
def test_without_a_text_nothing_is_masked_be_the_camera_still_or_not(tmp_path, step):
    assert find_captions(film(tmp_path, step), tmp_path) == {}


def test_a_still_camera_s_text_is_part_of_its_background(tmp_path):
    assert find_captions(film(tmp_path, 0, "hello, hello"), tmp_path) == {}
