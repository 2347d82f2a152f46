# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of painting a mask share."""

import pytest


@pytest.fixture
def session(addon):
    return addon("paint.session")


@pytest.fixture
def mask_image(addon):
    return addon("paint.mask_image")


@pytest.fixture
def paint_spot(session, mask_image):
    """Function that paints a few texels from a row on, and nothing else, and returns the file of such a mask."""

    def paint(row: int) -> bytes:
        mask = mask_image.mask_values(session.mask()) * 0
        mask[row : row + 4, 20:24] = 1
        mask_image.set_values(session.mask(), mask)
        return mask_image.grey_png(mask)

    return paint
