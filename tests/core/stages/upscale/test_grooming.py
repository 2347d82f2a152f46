# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hairs grown from masks: along strokes that were painted, covering as much as the mask says, in the colour that was
mixed in, on the skin and not in it."""

from functools import cache

import numpy as np
import pytest

from core.face import lids, template
from core.face.strands import SkinSurface, prisms
from core.geometry import raster
from core.geometry.meshes import joined
from core.stages.upscale import grooming, strokes, ways
from core.stages.upscale.hair import Hair
from core.stages.upscale.maps import HeadMaps
from core.stages.upscale.surface import HeadSurface, lay_out

SIZE = 1024
SKIN, HAIR = np.array([0.5, 0.35, 0.28]), np.array([0.04, 0.03, 0.02])


@cache
def surface() -> HeadSurface:
    return lay_out(template.load(), SIZE)


@cache
def brows() -> strokes.HairTexels:
    return strokes.lay_texels(surface(), (template.mask("brows", SIZE) > 0.5) & surface().covered)


def usual() -> np.ndarray:
    return ways.usual("brows", brows().position, template.landmark_points(surface().mesh))


def striped(degrees: float) -> tuple[np.ndarray, np.ndarray]:
    """Albedo [S, S, 3] with straight strokes 1 mm apart that rise by so much on the map, and the direction [2] across
    them."""
    texels, turn = brows(), np.radians(degrees)
    across = np.array([-np.sin(turn), np.cos(turn)])
    v, u = np.nonzero(texels.mask)
    phase = (u * across[0] - v * across[1]) * float(np.median(surface().texel[texels.mask]))
    albedo = np.broadcast_to(SKIN, (SIZE, SIZE, 3)).copy()
    albedo[texels.mask] *= (0.6 + 0.4 * np.cos(2 * np.pi * phase))[:, None]
    return albedo.astype(np.float32), across


def angles(way: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Degrees by which ways [N, 3] lie off the stripes."""
    return np.degrees(np.arcsin(np.clip(np.abs((brows().flatten(way) * across).sum(1)), 0, 1)))


@pytest.mark.parametrize("degrees", [-40, 0, 40])
def test_strokes_are_followed_wherever_they_go(degrees):
    albedo, across = striped(degrees)
    tensors = strokes.measure_tensors(albedo, brows(), float(np.median(surface().texel[brows().mask])))
    off = angles(strokes.choose_ways(tensors, brows(), usual(), grooming.TRUSTED_COHERENCE), across)
    assert np.median(off) < 4 and np.percentile(off, 90) < 15


def test_hair_lies_as_usual_where_no_stroke_is_seen_and_never_the_wrong_way_round():
    plain = np.broadcast_to(SKIN, (SIZE, SIZE, 3)).astype(np.float32)
    way = strokes.choose_ways(
        strokes.measure_tensors(plain, brows(), 0.25), brows(), usual(), grooming.TRUSTED_COHERENCE
    )
    assert (brows().flatten(way) * brows().flatten(usual())).sum(1).min() > 0.999
    albedo, _ = striped(60)
    way = strokes.choose_ways(
        strokes.measure_tensors(albedo, brows(), 0.25), brows(), usual(), grooming.TRUSTED_COHERENCE
    )
    assert (brows().flatten(way) * brows().flatten(usual())).sum(1).min() >= 0


def groomed(cover: float, seed: int = 0) -> tuple[dict, np.ndarray]:
    """Brows of which hair covers so much everywhere; the hairs, and the mask."""
    mask = cover * brows().mask.astype(np.float32)
    skin = np.broadcast_to(SKIN, (SIZE, SIZE, 3)).astype(np.float32)
    albedo = (1 - mask[..., None]) * skin + mask[..., None] * HAIR
    none = np.zeros((SIZE, SIZE), np.float32)
    maps = HeadMaps(
        albedo.astype(np.float32), none[..., None] + [0, 0, 1], none, none + 1, none[..., None] + np.ones(3), none + 1
    )
    return grooming.groom(maps, Hair(mask, none, none, none), skin, surface(), seed), mask


def test_hair_covers_as_much_of_the_skin_as_the_mask_says():
    """Rays along the normals from a centimetre before the brow: how many meet a hair."""
    texels = brows()
    inner = np.flatnonzero(np.abs(np.abs(texels.position[:, 0]) - 32) < 12)  # the ends are thin: hairs leave them
    for cover in (0.2, 0.4):
        hairs, _ = groomed(cover)
        mesh = joined([template.load(), prisms(hairs["brows"], sides=6)])
        origins = (texels.position[inner] + 10 * texels.normal[inner]) / 1000
        face, _, _ = raster.RayCaster(mesh).first_hits(origins, -texels.normal[inner])
        seen = (face >= len(template.load().faces)).mean()
        assert seen == pytest.approx(cover, rel=0.3), (cover, seen)


def test_hair_has_the_colour_that_mixes_with_the_skin_to_what_is_seen():
    for cover in (0.3, 0.8):
        colour = groomed(cover)[0]["brows"].colour
        assert np.exp(np.log(colour).mean(0)) == pytest.approx(HAIR, rel=0.1)


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
    hairs, mask = groomed(0.4)
    skin = SkinSurface(template.load())
    for part, grown in hairs.items():
        assert np.abs(skin.height(grown.points[:, 0])[0]).max() < 0.002
        assert (skin.height(grown.points[:, 1:].reshape(-1, 3))[0] > -0.0005).mean() > 0.97, part
    length = np.linalg.norm(np.diff(hairs["brows"].points, axis=1), axis=2).sum(1) * 1000
    assert 3 < np.median(length) < 9 and length.max() < 13
    for side, sign in ((0, 1), (1, -1)):
        edge = lids.closed_edge(template.load().vertices, side, 0, 0.0)
        roots = hairs["lashes"].points[:, 0]
        own = roots[np.sign(roots[:, 0]) == sign]
        assert np.min(np.linalg.norm(own[:, None] - edge[None], axis=2), 1).max() < 0.0015


def test_the_same_seed_gives_the_same_file_without_pickles(tmp_path):
    for name, seed in (("a", 0), ("b", 0), ("c", 1)):
        grooming.write(tmp_path / f"{name}.npz", groomed(0.3, seed)[0])
    a, b, c = ((tmp_path / f"{name}.npz").read_bytes() for name in "abc")
    assert a == b != c
    with np.load(tmp_path / "a.npz", allow_pickle=False) as stored:
        assert {name.partition("_")[0] for name in stored.files} == {"brows", "lashes"}
        assert (
            stored["brows_points"].shape[1:] == (grooming.POINTS_PER_HAIR, 3)
            and stored["brows_radius"].shape == stored["brows_points"].shape[:2]
        )


def test_a_face_without_hair_grows_none():
    assert groomed(0.0)[0] == {}
