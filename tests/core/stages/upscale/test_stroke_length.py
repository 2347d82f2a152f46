# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How long strokes are, against strokes that were painted; stubble is grown as short as it is, a beard as beards
are."""

from functools import cache

import cv2
import numpy as np
import pytest

from core.face import template
from core.stages.upscale import grooming, hair, stroke_length, strokes, ways
from core.stages.upscale.hair import Hair
from core.stages.upscale.maps import HeadMaps
from core.stages.upscale.surface import HeadSurface, lay_out

SIZE, SKIN = 1024, np.array([0.5, 0.35, 0.28])


@cache
def surface() -> HeadSurface:
    return lay_out(template.load(), SIZE)


@cache
def chin() -> tuple[strokes.HairTexels, np.ndarray]:
    """Where a beard grows, and how it usually lies there."""
    texels = strokes.lay_texels(surface(), (hair._zones(surface())["beard"] > 0.9) & surface().covered)
    return texels, ways.usual("beard", texels.position, template.landmark_points(surface().mesh))


@cache
def texel() -> float:
    return float(np.median(surface().texel[chin()[0].mask]))


def painted(length_mm: float, across: bool = False) -> np.ndarray:
    """Log albedo [S, S] with 0.7 strokes per mm^2 of that length along the usual way, or across it, over grain."""
    texels, way = chin()
    rng, flat = np.random.default_rng(3), texels.flatten(way)
    flat = np.stack([-flat[:, 1], flat[:, 0]], 1) if across else flat
    drawn, (v, u) = np.zeros((SIZE, SIZE), np.uint8), np.nonzero(texels.mask)
    for at in rng.choice(len(u), round(0.7 * len(u) * texel() ** 2)):
        start = np.array([u[at], v[at]]) + rng.uniform(-0.5, 0.5, 2)
        end = start + flat[at] * [1, -1] * length_mm / texel()
        ends = [tuple(round(16 * x) for x in point) for point in (start, end)]
        cv2.line(drawn, *ends, 255, 1, cv2.LINE_AA, 4)
    return (-0.3 / 255 * drawn + rng.normal(0, 0.02, drawn.shape)).astype(np.float32)


@pytest.mark.parametrize("length_mm", [1.2, 2.5, 5.0])
def test_strokes_are_as_long_as_they_were_painted_however_sharp_the_picture_is(length_mm):
    for blur in (0, 1.5):
        light = painted(length_mm)
        light = cv2.GaussianBlur(light, (0, 0), blur) if blur else light
        assert stroke_length.measure_stroke_length(light, *chin(), texel()) == pytest.approx(length_mm, rel=0.4)


def test_strokes_across_the_beard_are_none_of_its_hairs():
    assert stroke_length.measure_stroke_length(painted(3.0, across=True), *chin(), texel()) == 0


def test_what_lies_beside_the_beard_is_none_of_its_strokes():
    for beside in (-1.0, 1.0):
        light = (painted(1.2) + beside * ~chin()[0].mask).astype(np.float32)
        assert stroke_length.measure_stroke_length(light, *chin(), texel()) == pytest.approx(1.2, rel=0.4)


def test_of_a_beard_that_is_nowhere_wide_all_is_measured():
    texels, _ = chin()
    rows = np.nonzero(texels.mask)[0]
    band = texels.mask & (np.abs(np.mgrid[0:SIZE, 0:SIZE][0] - np.median(rows)) < 2.0 / texel())
    narrow = strokes.lay_texels(surface(), band)
    way = ways.usual("beard", narrow.position, template.landmark_points(surface().mesh))
    assert stroke_length.measure_stroke_length(painted(1.2), narrow, way, texel()) == pytest.approx(1.2, rel=0.4)


def beard(light: np.ndarray) -> np.ndarray:
    """Lengths in mm of the beard that is grown where half of the chin is hair, by the albedo of that light."""
    mask = 0.5 * chin()[0].mask.astype(np.float32)
    skin = np.broadcast_to(SKIN, (SIZE, SIZE, 3)).astype(np.float32)
    none, one = np.zeros((SIZE, SIZE), np.float32), np.ones((SIZE, SIZE), np.float32)
    maps = HeadMaps(
        (skin * np.exp(light)[..., None]).astype(np.float32),
        one[..., None] * [0, 0, 1],
        one,
        one,
        np.repeat(one[..., None], 3, 2),
        one,
    )
    points = grooming.groom(maps, Hair(none, none, mask, none), skin, surface())["beard"].points
    return 1000 * np.linalg.norm(np.diff(points, axis=1), axis=2).sum(1)


def test_stubble_is_grown_as_short_and_as_sparse_as_it_is():
    lengths = beard(painted(1.2))
    assert lengths.mean() == pytest.approx(1.2, rel=0.4)
    assert len(lengths) < 0.8 * (surface().texel[chin()[0].mask] ** 2).sum()


@pytest.mark.parametrize(
    ("length_mm", "shade"), [(5.0, 0.0), (1.2, -0.6)], ids=["long strokes", "darker than stubble's shade"]
)
def test_a_beard_is_grown_as_long_as_beards_are(length_mm, shade):
    assert beard(painted(length_mm) + np.float32(shade)).mean() == pytest.approx(grooming.KINDS[1].length[0], rel=0.2)
