# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hairs grown from masks: along strokes that were painted and as long as they are, covering as much as the mask says, in
the colour that was mixed in, on the skin and not in it."""

from functools import cache

import cv2
import numpy as np
import pytest

from core.face import lids, template
from core.face.strands import SkinSurface, prisms
from core.geometry import raster
from core.geometry.meshes import joined
from core.stages.upscale import grooming, stroke_length, strokes
from core.stages.upscale.hair import Hair
from tests.fixtures.hairy_head import growing, maps_of, surface

SIZE = 1024
SKIN, HAIR = np.array([0.5, 0.35, 0.28]), np.array([0.04, 0.03, 0.02])


def brows() -> strokes.HairTexels:
    return growing("brows", SIZE)[0]


def chosen(albedo: np.ndarray) -> np.ndarray:
    """Ways along the skin [N, 2] by an albedo's strokes."""
    texels, usual, texel = growing("brows", SIZE)
    tensors = strokes.measure_tensors(albedo, texels, texel)
    return texels.flatten(strokes.choose_ways(tensors, texels, usual, grooming.TRUSTED_COHERENCE))


def striped(degrees: float) -> tuple[np.ndarray, np.ndarray]:
    """Albedo [S, S, 3] with straight strokes 1 mm apart that rise by so much on the map, and the direction [2] across
    them."""
    (texels, _, texel), turn = growing("brows", SIZE), np.radians(degrees)
    across = np.array([-np.sin(turn), np.cos(turn)])
    v, u = np.nonzero(texels.mask)
    phase = (u * across[0] - v * across[1]) * texel
    albedo = np.broadcast_to(SKIN, (SIZE, SIZE, 3)).copy()
    albedo[texels.mask] *= (0.6 + 0.4 * np.cos(2 * np.pi * phase))[:, None]
    return albedo.astype(np.float32), across


@pytest.mark.parametrize("degrees", [-40, 40])
def test_strokes_are_followed_wherever_they_go(degrees):
    albedo, across = striped(degrees)
    off = np.degrees(np.arcsin(np.clip(np.abs((chosen(albedo) * across).sum(1)), 0, 1)))
    assert np.median(off) < 4 and np.percentile(off, 90) < 15


def test_hair_lies_as_usual_where_no_stroke_is_seen_and_never_the_wrong_way_round():
    usual = brows().flatten(growing("brows", SIZE)[1])
    assert (chosen(np.broadcast_to(SKIN, (SIZE, SIZE, 3)).astype(np.float32)) * usual).sum(1).min() > 0.999
    assert (chosen(striped(60)[0]) * usual).sum(1).min() >= 0


def groomed(cover: float, seed: int = 0) -> dict:
    """The hairs where hair covers so much of the brows everywhere."""
    mask, none = cover * brows().mask.astype(np.float32), np.zeros((SIZE, SIZE), np.float32)
    skin = np.broadcast_to(SKIN, (SIZE, SIZE, 3)).astype(np.float32)
    maps = maps_of((1 - mask[..., None]) * skin + mask[..., None] * HAIR)
    return grooming.groom(maps, Hair(mask, none, none, none), skin, surface(SIZE), seed)


@cache
def hairs(cover: float = 0.4) -> dict:
    return groomed(cover)


@pytest.mark.parametrize("cover", [0.2, 0.4])
def test_hair_covers_as_much_of_the_skin_as_the_mask_says_in_the_colour_that_mixes_to_what_is_seen(cover):
    """Rays along the normals from a centimetre before the brow: how many meet a hair."""
    texels, grown = brows(), hairs(cover)["brows"]
    inner = np.flatnonzero(np.abs(np.abs(texels.position[:, 0]) - 32) < 12)  # the ends are thin: hairs leave them
    mesh = joined([template.load(), prisms(grown, sides=6)])
    origins = (texels.position[inner] + 10 * texels.normal[inner]) / 1000
    face, _, _ = raster.RayCaster(mesh).first_hits(origins, -texels.normal[inner])
    assert (face >= len(template.load().faces)).mean() == pytest.approx(cover, rel=0.3)
    assert np.exp(np.log(grown.colour).mean(0)) == pytest.approx(HAIR, rel=0.1)


def test_black_hair_is_not_blue_where_the_skin_below_is_a_little_off():
    cover = np.full((64, 64), 0.6, np.float32)
    albedo = (1 - cover[..., None]) * SKIN * [1, 1, 1.1] + cover[..., None] * 0.004
    colour = grooming._unmix(albedo, np.broadcast_to(SKIN, albedo.shape), cover, 5.0)
    assert (colour[..., 2] <= colour[..., 0]).all() and colour.max() < 0.02


def test_hair_that_was_hidden_has_the_colour_of_the_rest_and_is_brown_where_none_was_seen():
    skin, cover = np.broadcast_to(SKIN, (64, 64, 3)), np.zeros((64, 64), np.float32)
    assert grooming._unmix(skin, skin, cover, 2.0) == pytest.approx(np.broadcast_to(grooming.BROWN_LINEAR, skin.shape))
    cover[:, :32] = 0.5
    colour = grooming._unmix((1 - cover[..., None]) * skin + cover[..., None] * HAIR, skin, cover, 2.0)
    assert colour[:, 50:] == pytest.approx(np.broadcast_to(HAIR, (64, 14, 3)), rel=0.01)


def test_hair_roots_on_the_skin_in_its_mask_and_stays_outside_of_the_head():
    skin = SkinSurface(template.load())
    for part, grown in hairs().items():
        assert np.abs(skin.height(grown.points[:, 0])[0]).max() < 0.002
        assert (skin.height(grown.points[:, 1:].reshape(-1, 3))[0] > -0.0005).mean() > 0.97, part
    length = np.linalg.norm(np.diff(hairs()["brows"].points, axis=1), axis=2).sum(1) * 1000
    assert 3 < np.median(length) < 9 and length.max() < 13
    for side, sign in ((0, 1), (1, -1)):
        edge = lids.closed_edge(template.load().vertices, side, 0, 0.0)
        roots = hairs()["lashes"].points[:, 0]
        own = roots[np.sign(roots[:, 0]) == sign]
        assert np.min(np.linalg.norm(own[:, None] - edge[None], axis=2), 1).max() < 0.0015


def test_the_same_seed_gives_the_same_file_without_pickles(tmp_path):
    for name, grown in (("a", hairs()), ("b", groomed(0.4)), ("c", groomed(0.4, 1))):
        grooming.write(tmp_path / f"{name}.npz", grown)
    a, b, c = ((tmp_path / f"{name}.npz").read_bytes() for name in "abc")
    assert a == b != c
    with np.load(tmp_path / "a.npz", allow_pickle=False) as stored:
        assert {name.partition("_")[0] for name in stored.files} == {"brows", "lashes"}
        count = len(stored["brows_points"])
        assert stored["brows_points"].shape == (count, grooming.POINTS_PER_HAIR, 3)
        assert stored["brows_radius"].shape == (count, grooming.POINTS_PER_HAIR)


def test_a_face_without_hair_grows_none():
    assert groomed(0.0) == {}


def measured(light: np.ndarray) -> float:
    return stroke_length.measure_stroke_length(light, *growing("beard", SIZE))


@cache
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


def test_what_lies_beside_the_beard_or_across_it_is_none_of_its_strokes():
    assert measured(painted(3.0, across=True)) == 0
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
