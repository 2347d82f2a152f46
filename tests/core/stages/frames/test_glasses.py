# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Glasses: a capture with them is refused where nearly all frames agree, the artist can overrule that, doubt is a
warning."""

import cv2
import numpy as np
import pytest
from skimage.data import astronaut

from core.capture.messages import Problem, Reporter
from core.face import faces
from core.face.glasses import sureness
from core.imaging import images
from core.stages.frames.glasses import SURE_LOG_ODDS, judge
from tests.fixtures.moving_face import refused

FACE = astronaut().astype(np.float32)[:300, 60:400] / 255


def with_rims(srgb: np.ndarray, thick: int = 4) -> np.ndarray:
    """Round black rims with a bridge and temples, painted over a face."""
    marks, over = faces.detect(srgb).landmarks[:, :2], srgb.copy()
    middles = [marks[list(corners)].mean(0) for corners in (faces.RIGHT_EYE, faces.LEFT_EYE)]
    reach = 0.36 * np.linalg.norm(middles[1] - middles[0])
    for middle in middles:
        circle = np.round(middle + [0, 0.15 * reach]).astype(int).tolist()
        cv2.circle(over, circle, round(reach), (0.03, 0.03, 0.03), thick, cv2.LINE_AA)
    across = (middles[1] - middles[0]) / np.linalg.norm(middles[1] - middles[0])
    ends = [
        (middles[0] + reach * across, middles[1] - reach * across),
        (middles[0] - reach * across, marks[234]),
        (middles[1] + reach * across, marks[454]),
    ]
    for a, b in np.round(ends).astype(int).tolist():
        cv2.line(over, a, b, (0.03, 0.03, 0.03), thick, cv2.LINE_AA)
    return over


def test_rims_are_told_from_a_bare_face_and_a_capture_with_glasses_is_refused(capture, folder):
    worn = with_rims(FACE)
    assert sureness(FACE, faces.detect(FACE)) < -1 and sureness(worn, faces.detect(worn)) > SURE_LOG_ODDS
    for k in range(3):
        images.write_srgb(folder / f"{k}.png", worn[10 * k : 10 * k + 260, 20 * k : 20 * k + 280])
    refused(capture, folder, "wears glasses in 3 of 3 frames")


@pytest.mark.parametrize(
    ("odds", "no_glasses", "finding"),
    [
        ([9.0, 9.0], False, True),
        ([9.0, 9.0, 1.0, 1.0, 9.0], False, True),
        ([0.7] * 10, False, True),
        ([9.0] * 5 + [-1.0] * 5, False, True),
        ([], False, False),
        ([float("nan")] * 4, False, False),
        ([-2.0] * 10 + [9.0] * 4, False, False),
        ([9.0] * 4, True, False),
    ],
)
def test_doubt_is_a_warning_and_few_frames_or_the_artist_refuse_nothing(odds, no_glasses, finding):
    report = Reporter("frames")
    judge(odds, no_glasses, report)
    assert ["glasses" in each["problem"] for each in report.findings] == [True] * finding


def test_the_remedy_says_how_to_overrule():
    with pytest.raises(Problem) as raised:
        judge([9.0] * 4, False, Reporter("frames"))
    assert "frames.no_glasses" in raised.value.remedy
