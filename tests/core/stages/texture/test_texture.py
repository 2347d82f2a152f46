# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A painted head is photographed by known cameras: the texture stage must give the paint back, where it was seen."""

import cv2
import numpy as np
import pytest

from core.capture.messages import CancelledError, Progress, Reporter
from core.imaging import images
from core.settings.settings import from_json
from core.stages import texture
from tests.fixtures.photographed_head import capture_of, skin
from tests.fixtures.refused import refused

SIZE = 256
SETTINGS = from_json({"texture": {"size": SIZE}})
ROUND = (-70, -45, -20, 0, 20, 45, 70)


def textured(capture):
    """(I_UV, confidence, figures) of a capture."""
    report = Reporter("texture")
    texture.run(capture, SETTINGS, report)
    return images.read_linear(capture.texture), images.read_mask(capture.texture_confidence), report.figures


def detail(linear):
    log = np.log(np.maximum(linear[..., 1], 1e-3))
    return cv2.GaussianBlur(log, (0, 0), 0.7) - cv2.GaussianBlur(log, (0, 0), 4)


@pytest.fixture(scope="module")
def painted():
    return skin(SIZE)


def test_the_paint_comes_back_where_it_was_seen(tmp_path, painted):
    """From views of other exposures, whose spread is evened out."""
    gains = np.array([1.0, 1.25, 0.8, 1.1, 0.9, 1.2, 0.85])
    capture = capture_of(tmp_path / "tête à peindre.wildcap", painted, ROUND, lambda i, picture: picture * gains[i])
    found, confidence, figures = textured(capture)
    sure = confidence > 0.6
    assert sure.mean() > 0.25
    ratio = np.log(found / painted)
    level = ratio[sure].mean()
    error = np.abs(ratio - level)[sure]
    assert np.median(error) < 0.02 and np.percentile(error, 95) < 0.10 and abs(level) < 0.12
    assert cv2.GaussianBlur(ratio, (0, 0), 3)[sure].std() < 0.03, "no view's exposure is left in the map"
    assert abs(figures["gain_spread_percent"] - 100 * np.log(gains).std()) < 3
    assert np.corrcoef(detail(found)[sure], detail(painted)[sure])[0, 1] > 0.93
    assert figures["views"] == len(ROUND) and 30 < figures["seen_percent"] < 90
    twin = images.read_srgb(capture.texture_png)
    assert np.abs(twin - images.linear_to_srgb(found)).max() < 0.004  # 8 bit and half float
    assert np.isfinite(found).all() and found.min() > 0, "holes are filled"


def test_the_filmed_texture_is_the_delit_one_with_its_light(tmp_path, painted):
    """Also: a canceled run leaves nothing, the bar does not go back, and without frames nothing filmed is kept."""
    across = np.broadcast_to(np.linspace(0.4, 1.6, SIZE, dtype=np.float32), (SIZE, SIZE))
    light = np.stack([across, np.full_like(across, 0.7), across.T], -1)
    capture = capture_of(tmp_path / "lit", painted, (-40, 0, 40), light=light, distance=0.35)
    with pytest.raises(CancelledError):
        texture.run(capture, SETTINGS, Reporter("texture", cancelled=lambda: True))
    assert not capture.texture.exists()
    messages = []
    texture.run(capture, SETTINGS, Reporter("texture", messages.append))
    sure = images.read_mask(capture.texture_confidence) > 0.6
    filmed = images.read_linear(capture.texture_filmed) / images.read_linear(capture.texture)
    assert np.median(np.abs(np.log(filmed / light))[sure]) < 0.03
    assert np.corrcoef(filmed[sure][:, 0], light[sure][:, 0])[0, 1] > 0.97
    steps = [m for m in messages if isinstance(m, Progress) and m.of == 3 + 6]  # a view each, and six beside
    assert any("fine detail" in m.text for m in steps) and "as filmed" in steps[-1].text
    assert [m.done for m in steps] == sorted(m.done for m in steps)
    for path in capture.frames.glob("*.jpg"):
        path.unlink()
    textured(capture)
    assert capture.texture.is_file() and not capture.texture_filmed.exists()


def test_what_no_view_saw_has_no_confidence(tmp_path, painted):
    capture = capture_of(tmp_path / "left", painted, (40, 60, 80))
    found, confidence, _ = textured(capture)
    u = (np.arange(SIZE) + 0.5) / SIZE
    middle = slice(SIZE // 3, 2 * SIZE // 3)
    left, right = (u > 0.72) & (u < 0.85), u < 0.28
    assert confidence[middle][:, left].min() > 0.5
    assert confidence[middle][:, right].max() == 0
    assert detail(found)[middle][:, right].std() < 0.1 * detail(painted).std(), "the unseen side is filled smoothly"


def test_a_dot_on_the_left_cheek_lands_on_the_left_cheek(tmp_path):
    paint = np.full((SIZE, SIZE, 3), 0.4, np.float32)
    row, column = round(0.6 * SIZE), round(0.6 * SIZE)  # v = 0.4, below the middle; u = 0.6, the person's left
    cv2.circle(paint, (column, row), 5, (0.05, 0.05, 0.05), -1)
    found, _, _ = textured(capture_of(tmp_path / "dot", paint, (-20, 10, 40)))
    dark = found.mean(-1) < 0.2
    where = np.argwhere(dark).mean(0)
    assert dark.sum() > 30 and np.abs(where - [row, column]).max() < 1.5
    mirrored = found[row - 4 : row + 5, SIZE - column - 5 : SIZE - column + 4]
    assert np.abs(mirrored - 0.4).max() < 0.03


def test_views_that_are_off_by_pixels_are_aligned(tmp_path, painted):
    offsets = [(3.2, 0.8), (-2.8, -1.2), (3.0, 1.6), (-3.4, 0.0), (2.4, -2.0), (-3.0, 1.6), (2.6, 0.8)]

    def shifted(i, picture):
        return cv2.warpAffine(
            picture,
            np.array([[1, 0, offsets[i][0]], [0, 1, offsets[i][1]]]),
            picture.shape[1::-1],
            flags=cv2.INTER_CUBIC,
        )

    found, confidence, figures = textured(capture_of(tmp_path / "shifted", painted, ROUND, shifted))
    sure = confidence > 0.8
    assert 1 < figures["alignment_shift_texels"] < 2.5  # 3 pixels are 1.5 texels
    assert figures["disagreement_percent"] < 0.6  # 1.9 without alignment
    assert np.corrcoef(detail(found)[sure], detail(painted)[sure])[0, 1] > 0.94  # 0.86 without alignment


def test_no_delit_frame_is_a_problem(tmp_path):
    capture = capture_of(tmp_path / "none", np.full((16, 16, 3), 0.4, np.float32), (0,))
    for path in capture.delit.iterdir():
        path.unlink()
    refused(lambda: textured(capture), "delit frame")
