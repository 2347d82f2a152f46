# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that follows the normals is told from a face's own large shapes, in brightness and in colour apart."""

import cv2
import numpy as np
import pytest
import torch

from core.solve.lighting import constant_light, shading_basis
from core.solve.traits import held

SIZE = 128
TEXEL = 1024 / SIZE
Y, X = np.mgrid[:SIZE, :SIZE] / SIZE * 2 - 1
NORMAL = torch.from_numpy(np.stack([X, -np.sqrt(np.clip(2 - X**2 - Y**2, 0.05, None)), -Y]).astype(np.float32))
NORMAL = NORMAL / NORMAL.norm(dim=0)
SKIN = torch.from_numpy((X**2 + Y**2 < 0.9).astype(np.float32))
REFERENCE = torch.tensor([0.4, 0.25, 0.2])[:, None, None].expand(3, SIZE, SIZE)
GREY, WARM = (1.0, 1.0, 1.0), (0.6, 0.0, -0.6)


def shapes(colour, amount, seed):
    """exp of a face's own large shapes [3, S, S] of that deviation, in a colour; a seventh of the face in diameter."""
    noise = cv2.GaussianBlur(np.random.default_rng(seed).standard_normal((SIZE, SIZE)), (0, 0), 40 / TEXEL)
    return torch.from_numpy(np.exp(amount * np.multiply.outer(np.array(colour), noise / noise.std())).astype(np.float32))


def lamp(colour, amount):
    """Shading [3, S, S] about one of a lamp from above and the front, in a colour."""
    gamma = constant_light(torch.ones(3))
    gamma[:, [1, 2, 5]] += amount * torch.tensor(colour)[:, None] * torch.tensor([0.5, 1.0, -0.4])
    return torch.einsum("ck,khw->chw", gamma, shading_basis(NORMAL))


def told(texture):
    return held(texture, REFERENCE, NORMAL, SKIN, TEXEL)


@pytest.mark.parametrize("seed", range(4))
def test_traits_hold_the_light_and_a_lamp_does_not(seed):
    assert told(REFERENCE * shapes(GREY, 0.1, seed))[0] == told(REFERENCE * shapes(WARM, 0.1, seed))[1] == 1
    assert told(REFERENCE * shapes(GREY, 0.02, seed) * lamp(GREY, 0.3))[0] < 0.01
    faint, strong, spotted = (told(REFERENCE * shapes(GREY, a, seed) * lamp(GREY, b))[0] for a, b in ((0.03, 0.1), (0.03, 0.2), (0.1, 0.1)))
    assert strong < faint < 0.1 and spotted > 5 * faint


@pytest.mark.parametrize("seed", range(4))
def test_brightness_and_colour_are_told_apart(seed):
    brightness, colour = told(REFERENCE * shapes(GREY, 0.12, seed) * shapes(WARM, 0.01, seed + 9) * lamp(WARM, 0.3))
    assert brightness > 0.9 and colour < 0.02
    brightness, colour = told(REFERENCE * shapes(WARM, 0.12, seed) * shapes(GREY, 0.01, seed + 9) * lamp(GREY, 0.3))
    assert brightness < 0.02 and colour > 0.9


def test_exposure_changes_nothing_and_a_light_is_held_where_nothing_is_to_be_told():
    texture = REFERENCE * shapes(GREY, 0.05, 0) * lamp(GREY, 0.2)
    assert told(1.3 * texture) == pytest.approx(told(texture), abs=0.01) and 0 < told(texture)[0] < 0.5
    assert told(REFERENCE * (1 + 0 * texture)) == (1.0, 1.0), "the reference itself"
    assert held(texture, REFERENCE, NORMAL, 0 * SKIN, TEXEL) == (1.0, 1.0), "nothing was seen"
