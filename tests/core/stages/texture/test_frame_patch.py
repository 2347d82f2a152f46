# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A frame unfolded to copy from: in place, in the solved albedo's tone, and clear where the frame sees nothing."""

import numpy as np
import pytest

from core.capture.messages import Reporter
from core.imaging import images
from core.settings.settings import from_json
from core.stages.texture import frame_patch
from tests.fixtures.photographed_head import capture_of, skin
from tests.fixtures.refused import refused

SIDE = 512


@pytest.fixture(scope="module")
def paint() -> np.ndarray:
    return skin(SIDE)


@pytest.fixture(scope="module")
def capture(tmp_path_factory, paint):
    """A head filmed from in front and from its left, whose albedo was solved half as bright and redder."""
    capture = capture_of(tmp_path_factory.mktemp("patch") / "a.wildcap", paint, (0, 50))
    images.write_linear(capture.maps / "diffuse_albedo.exr", paint * np.float32([0.6, 0.5, 0.4]))
    return capture


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Place the frames on a smaller map: in a test minutes matter."""
    monkeypatch.setattr(frame_patch, "OBSERVED_TEXELS", 384)


def run(capture, frame: str) -> np.ndarray:
    frame_patch.run(capture, from_json({"retouch": {"frame": frame, "size": SIDE}}), Reporter("retouch_frame"))
    return images.read_straight(capture.preview / frame_patch.NAME)[0]


def test_it_shows_what_the_frame_saw_in_the_tone_of_the_albedo(capture, paint):
    seen = run(capture, "00000.jpg")
    sure = seen[..., 3] > 0.99
    assert 0.1 < sure.mean() < 0.6
    got, wanted = images.srgb_to_linear(seen[..., :3])[sure], (paint * np.float32([0.6, 0.5, 0.4]))[sure]
    assert np.abs(np.log(got / wanted)).mean() < 0.06
    assert np.corrcoef(got[:, 0], wanted[:, 0])[0, 1] > 0.9, "its pores are in place"


def test_another_side_is_seen_by_another_frame(capture):
    front, left = (run(capture, name)[..., 3] for name in ("00000.jpg", "00001.jpg"))
    halves = [
        [cover[:, part].sum() for part in (slice(0, SIDE // 2), slice(SIDE // 2, SIDE))] for cover in (front, left)
    ]
    assert abs(halves[0][0] / halves[0][1] - 1) < 0.1 and halves[1][1] > 1.5 * halves[1][0]


def test_a_frame_that_was_not_delit_is_refused(capture):
    refused(lambda: run(capture, "00009.jpg"), "00009.jpg", "Delight")
