# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An unseen neck gets the colour that measured necks have beside such faces; nothing else changes."""

import cv2
import numpy as np
import pytest
from skimage import color

from core.face import neck, template
from core.imaging import images

SIZE = 128


def lab(linear: np.ndarray) -> np.ndarray:
    return color.rgb2lab(images.linear_to_srgb(np.asarray(linear)))


@pytest.mark.parametrize(
    ("tone", "lighter", "redder"),
    [((0.42, 0.24, 0.17), (-0.5, 3.0), (-6.0, -3.0)), ((0.10, 0.05, 0.03), (-4.0, -2.0), (-1.5, 1.0))],
)
def test_a_fair_neck_is_less_red_than_its_face_and_a_dark_one_darker(tone, lighter, redder):
    """As the archive has it: L* +3 to 0 and a* -6 to -3 in fair people, L* -3.3 and a* -0.5 in African ones."""
    lightness, red, _ = lab(neck.expect_neck(np.array(tone))) - lab(np.array(tone))
    assert lighter[0] < lightness < lighter[1] and redder[0] < red < redder[1]


def test_only_what_was_not_seen_of_the_neck_changes():
    tone, where = np.array([0.3, 0.19, 0.14]), template.mask("neck", SIZE)
    albedo = (tone * (1 + 0.4 * where[..., None])).astype(np.float32)
    unseen = np.zeros((SIZE, SIZE), np.float32)
    unseen[:, : SIZE // 2] = 1
    given = albedo * neck.neck_gain(albedo, tone, unseen)
    assert given[unseen == 0].tobytes() == albedo[unseen == 0].tobytes()
    reach = np.ones((round(neck.FADE_SHARE * SIZE) + 5,) * 2)
    far, deep = cv2.dilate(where, reach) == 0, cv2.erode(where * unseen, reach) == 1
    assert far.sum() > 100 and given[far].tobytes() == albedo[far].tobytes()
    assert deep.sum() > 100 and np.allclose(given[deep], neck.expect_neck(tone), rtol=0.02)
    assert np.all(neck.neck_gain(albedo, tone, np.zeros_like(unseen)) == 1)
