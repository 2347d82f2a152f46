# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How long strokes are, against strokes that were painted; stubble is grown as short as it is, a beard as beards
are."""

import cv2
import numpy as np
import pytest

from core.stages.upscale import grooming, stroke_length, strokes
from core.stages.upscale.hair import Hair
from tests.fixtures.hairy_head import growing, maps_of, surface

SIZE, SKIN = 1024, np.array([0.5, 0.35, 0.28])


def measured(light: np.ndarray) -> float:
    return stroke_length.measure_stroke_length(light, *growing("beard", SIZE))


def painted(length_mm: float, across: bool = False) -> np.ndarray:
    """Log albedo [S, S] with 0.7 strokes per mm^2 of that length along the usual way, or across it, over grain."""
    texels, way, texel = growing("beard", SIZE)
    rng, flat = np.random.default_rng(3), texels.flatten(way)
    flat = np.stack([-flat[:, 1], flat[:, 0]], 1) if across else flat
    drawn, (v, u) = np.zeros((SIZE, SIZE), np.uint8), np.nonzero(texels.mask)
    for at in rng.choice(len(u), round(0.7 * len(u) * texel**2)):
        start = np.array([u[at], v[at]]) + rng.uniform(-0.5, 0.5, 2)
        end = start + flat[at] * [1, -1] * length_mm / texel
        ends = [tuple(round(16 * x) for x in point) for point in (start, end)]
        cv2.line(drawn, *ends, 255, 1, cv2.LINE_AA, 4)
    return (-0.3 / 255 * drawn + rng.normal(0, 0.02, drawn.shape)).astype(np.float32)


@pytest.mark.parametrize(("length_mm", "blur"), [(1.2, 0), (2.5, 1.5), (5.0, 0)])
def test_strokes_are_as_long_as_they_were_painted_however_sharp_the_picture_is(length_mm, blur):
    light = painted(length_mm)
    assert measured(cv2.GaussianBlur(light, (0, 0), blur) if blur else light) == pytest.approx(length_mm, rel=0.4)


def test_strokes_across_the_beard_are_none_of_its_hairs():
    assert measured(painted(3.0, across=True)) == 0


def test_what_lies_beside_the_beard_is_none_of_its_strokes():
    for beside in (-1.0, 1.0):
        light = (painted(1.2) + beside * ~growing("beard", SIZE)[0].mask).astype(np.float32)
        assert measured(light) == pytest.approx(1.2, rel=0.4)


def test_of_a_beard_that_is_nowhere_wide_all_is_measured():
    texels, way, texel = growing("beard", SIZE)
    rows = np.nonzero(texels.mask)[0]
    band = np.abs(rows - np.median(rows)) < 2.0 / texel
    mask = texels.mask.copy()
    mask[texels.mask] = band
    narrow = strokes.lay_texels(surface(SIZE), mask)
    assert stroke_length.measure_stroke_length(painted(1.2), narrow, way[band], texel) == pytest.approx(1.2, rel=0.4)


def beard(light: np.ndarray) -> np.ndarray:
    """Lengths in mm of the beard that is grown where half of the chin is hair, by the albedo of that light."""
    mask, none = 0.5 * growing("beard", SIZE)[0].mask.astype(np.float32), np.zeros((SIZE, SIZE), np.float32)
    skin = np.broadcast_to(SKIN, (SIZE, SIZE, 3)).astype(np.float32)
    maps = maps_of(skin * np.exp(light)[..., None])
    points = grooming.groom(maps, Hair(none, none, mask, none), skin, surface(SIZE))["beard"].points
    return 1000 * np.linalg.norm(np.diff(points, axis=1), axis=2).sum(1)


def test_stubble_is_grown_as_short_and_as_sparse_as_it_is():
    lengths = beard(painted(1.2))
    assert lengths.mean() == pytest.approx(1.2, rel=0.4)
    assert len(lengths) < 0.8 * (surface(SIZE).texel[growing("beard", SIZE)[0].mask] ** 2).sum()


@pytest.mark.parametrize(
    ("length_mm", "shade"), [(5.0, 0.0), (1.2, -0.6)], ids=["long strokes", "darker than stubble's shade"]
)
def test_a_beard_is_grown_as_long_as_beards_are(length_mm, shade):
    assert beard(painted(length_mm) + np.float32(shade)).mean() == pytest.approx(grooming.KINDS[1].length[0], rel=0.2)
