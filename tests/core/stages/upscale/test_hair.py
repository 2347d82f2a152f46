# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair: the masks against the hair that was painted, with the face parser's word and without, and the albedo below it
against the same skin painted without."""

from functools import cache

import cv2
import numpy as np
import pytest

from core.capture import stages
from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.face import shown_parts, template
from core.geometry import meshes
from core.imaging import images
from core.settings.settings import from_json
from core.stages import upscale
from core.stages.upscale import hair
from core.stages.upscale.maps import HeadMaps
from tests.fixtures.hairy_head import SIZE, beard_zone, maps_of, painted, surface
from tests.fixtures.refused import refused


@pytest.fixture(scope="module")
def heads() -> dict[str, HeadMaps]:
    """The same skin three times."""
    return {"bearded": painted(beard=1.0), "shaven": painted(), "hairless": painted(brows=0.0)}


@pytest.fixture(scope="module")
def found(heads) -> dict[str, hair.Hair]:
    return {name: hair.find(heads[name], surface()) for name in ("bearded", "shaven")}


def darker(hairy: HeadMaps, bare: HeadMaps) -> np.ndarray:
    """How much the hair takes from the albedo, log, [S, S]."""
    return np.clip(np.log(np.maximum(bare.diffuse, 0.004)) - np.log(np.maximum(hairy.diffuse, 0.004)), 0, None).mean(2)


def alike(a: np.ndarray, b: np.ndarray) -> float:
    face = template.mask("face", SIZE) > 0.5
    return float(np.corrcoef(a[face], b[face])[0, 1])


def test_brows_are_found_where_they_were_painted(heads, found):
    true = darker(heads["shaven"], heads["hairless"])
    brows = found["shaven"].brows
    assert alike(brows, true) > 0.85
    both, either = ((brows > 0.2) & (true > 0.3)).sum(), ((brows > 0.2) | (true > 0.3)).sum()
    assert both > 0.6 * either
    assert brows[template.mask("brows", SIZE) < 0.001].mean() < 1e-3


def test_lashes_lie_along_the_rims_of_the_lids(heads, found):
    lashes = found["shaven"].lashes
    eyes = template.mask("eyes", SIZE)
    assert lashes.max() > 0.5 and (lashes > 0.1)[eyes < 0.05].sum() == 0
    assert (lashes > 0.3).sum() < 0.2 * (eyes > 0.5).sum()


def test_a_beard_is_found_and_a_bare_chin_has_none(heads, found):
    true = darker(heads["bearded"], heads["shaven"])
    assert alike(found["bearded"].beard, true) > 0.6
    assert found["shaven"].beard.max() == 0


def test_the_skin_below_is_nearer_to_the_skin_painted_without_hair(heads, found):
    for name in ("bearded", "shaven"):
        cleaned, share = hair.clean(heads[name], found[name], surface())
        assert cleaned[share == 0].tobytes() == heads[name].diffuse[share == 0].tobytes()
        hairy = darker(heads[name], heads["hairless"]) > 0.05
        hairy &= template.mask("scalp", SIZE) < 0.01
        off = [
            np.abs(
                images.linear_to_srgb(albedo[hairy]) - images.linear_to_srgb(heads["hairless"].diffuse[hairy])
            ).mean()
            for albedo in (heads[name].diffuse, cleaned)
        ]
        assert off[1] < 0.75 * off[0], (name, off)
        assert share[template.mask("lips", SIZE) > 0.9].mean() < 0.02


def test_the_stage_writes_the_masks_and_the_clean_albedo(heads, tmp_path):
    capture, maps = Capture(tmp_path / "é.wildcap"), heads["bearded"]
    meshes.write_obj(capture.head, template.load())
    images.write_linear(capture.maps / "diffuse_albedo.exr", maps.diffuse)
    images.write_data(capture.maps / "normal.png", maps.normal * 0.5 + 0.5, bits=16)
    images.write_data(capture.maps / "specular_albedo.png", maps.specular, bits=16)
    images.write_data(capture.maps / "confidence.png", 0.7 * template.mask("face", SIZE))
    images.write_linear(capture.maps / "shading.exr", maps.shading)
    report = Reporter("upscale")
    upscale.run(capture, from_json({"upscale": {"size": 1024, "method": "lanczos"}}), report)
    masks = {name: images.read_mask(capture.maps_4k / f"{name}.png") for name in ("brows", "lashes", "beard")}
    assert all(mask.shape == (1024, 1024) and mask.max() > 0.3 for mask in masks.values())
    albedo, cleaned = (images.read_data(capture.maps_4k / f"{name}.png") for name in ("diffuse_albedo", "clean_albedo"))
    brow = masks["brows"] > 0.5
    assert cleaned[brow].mean() > albedo[brow].mean() + 0.05 and np.array_equal(cleaned[:20], albedo[:20])
    with np.load(capture.maps_4k / stages.STRANDS, allow_pickle=False) as stored:
        count = sum(len(stored[f"{part}_points"]) for part in ("brows", "lashes", "beard"))
        assert count == report.figures["hairs"] > 1000
    assert report.figures["beard_cm2"] > 1 and report.figures["completed_share_percent"] > 20
    written = {path.name for path in capture.maps_4k.iterdir()}
    assert written == {*stages.MAPS, "brows.png", "lashes.png", "beard.png", "clean_albedo.png", stages.STRANDS}
    assert all(
        capture.picture("upscale", name).is_file() for name in ("before_and_after_completion", "albedo_hair_skin_below")
    )


LIGHT, DARK = np.array([0.5, 0.35, 0.28]), np.array([0.07, 0.045, 0.035])
"""Skins, linear albedo."""
BLACK, WHITE = np.array([0.015, 0.012, 0.01]), np.array([0.5, 0.48, 0.45])
"""Hair."""


@cache
def regions() -> tuple[np.ndarray, np.ndarray]:
    """Where brows and beard are painted, bool [S, S]."""
    return template.mask("brows", SIZE) > 0.5, (beard_zone() > 0.9) & surface().covered


def strewn(where: np.ndarray, mean: float, spread: float, seed: int) -> np.ndarray:
    """A share of hair for each texel, [S, S]."""
    return where * np.clip(np.random.default_rng(seed).normal(mean, spread, (SIZE, SIZE)), 0, 1)


def hair_over(skin: np.ndarray, layers: list[tuple[np.ndarray, np.ndarray]], parts: np.ndarray | None) -> hair.Hair:
    """Hair where layers of it (share [S, S], colour [3]) lie over a skin of 2 % grain."""
    albedo = skin * (1 + 0.02 * np.random.default_rng(9).standard_normal((SIZE, SIZE, 1)))
    for share, colour in layers:
        albedo = albedo * (1 - share[..., None]) + share[..., None] * colour
    return hair.find(maps_of(albedo), surface(), parts)


def answer(brows: float = 0.0, beard: float = 0.0) -> np.ndarray:
    """A parser's answer that is so sure of each, [S, S, 3]."""
    where_brows, where_beard = regions()
    return np.stack([brows * where_brows, beard * where_beard, np.zeros((SIZE, SIZE))], -1).astype(np.float32)


@pytest.mark.parametrize(
    ("skin", "colour", "sure", "mean", "spread"),
    [
        (LIGHT, BLACK, 0.8, 0.4, 0.25),
        (DARK, WHITE, 0.8, 0.4, 0.25),
        (LIGHT, WHITE, 0.8, 0.4, 0.25),
        (LIGHT, BLACK, 0.3, 0.12, 0.05),
    ],
    ids=["dark beard", "white beard on dark skin", "white beard on light skin", "stubble"],
)
def test_a_beard_covers_as_much_as_was_painted(skin, colour, sure, mean, spread):
    """Within 0.06 in the mean, with black brows above it; nothing is found beside it."""
    where_brows, where = regions()
    brows, beard = strewn(where_brows, 0.6, 0.3, 1), strewn(where, mean, spread, 2)
    seen = hair_over(skin, [(brows, BLACK), (beard, colour)], answer(0.8, sure))
    assert seen.beard[where].mean() == pytest.approx(beard[where].mean(), abs=0.06)
    assert np.corrcoef(seen.beard[where], beard[where])[0, 1] > 0.7
    assert seen.beard[~where].mean() < 0.005


def test_a_bare_chin_that_the_parser_doubts_has_no_beard_whatever_moles_it_has():
    where_brows, where = regions()
    mole = np.zeros((SIZE, SIZE))
    v, u = np.unravel_index(cv2.distanceTransform(where.astype(np.uint8), cv2.DIST_L2, 5).argmax(), where.shape)
    mole[v : v + 2, u : u + 2] = 1
    seen = hair_over(LIGHT, [(strewn(where_brows, 0.6, 0.3, 1), BLACK), (mole, BLACK)], answer(0.8, 0.1))
    assert where[mole > 0].all() and seen.beard[where].mean() < 0.01 and seen.beard[mole > 0].max() < 0.1


def test_of_stubble_the_parser_is_as_sure_as_it_is_in_the_middle_of_it():
    """A shade without strokes, which it doubts all over and more so on the upper half."""
    where = regions()[1]
    upper = where & (np.mgrid[0:SIZE, 0:SIZE][0] < np.median(np.nonzero(where)[0]))
    parts = answer(brows=0.8, beard=0.6)
    parts[..., 1] = np.where(where, parts[..., 1], 0.08 * template.mask("face", SIZE))
    parts[upper, 1] = 0.35
    seen = hair_over(LIGHT, [(strewn(regions()[0], 0.6, 0.3, 1), BLACK), (0.1 * where, BLACK)], parts)
    assert seen.beard[upper].mean() > 0.7 * seen.beard[where & ~upper].mean() > 0.03
    assert seen.beard[~where].mean() < 0.005


def test_hair_of_the_colour_of_its_skin_is_as_usual_where_the_parser_is_sure():
    where = regions()[0]
    seen = hair_over(LIGHT, [], answer(brows=0.9))
    assert seen.brows[where].mean() == pytest.approx(hair.USUAL_COVER["brows"], abs=0.15)
    assert hair_over(LIGHT, [], None).brows.max() == 0


@pytest.mark.parametrize("both", [False, True], ids=["one side", "both sides"])
def test_brows_behind_a_fringe_are_like_the_other_one_or_as_usual(both):
    """A fringe over the forehead and one brow, or both: no hair of it becomes a brow."""
    where = regions()[0]
    v, u = np.mgrid[0:SIZE, 0:SIZE]
    forehead = (v < np.nonzero(where)[0].max() + 3) & (template.mask("face", SIZE) > 0.5) & (both | (u < SIZE // 2))
    brows, fringe = strewn(where, 0.35, 0.35, 1), strewn(forehead, 0.8, 0.3, 2)
    parts = answer(brows=0.8)
    parts[forehead] = [0, 0, 0.95]
    seen = hair_over(LIGHT, [(brows, BLACK), (fringe, BLACK)], parts)
    hidden = where & forehead
    usual = hair.USUAL_COVER["brows"] if both else brows[where & ~forehead].mean()
    assert seen.brows[hidden].mean() == pytest.approx(usual, abs=0.1)
    assert seen.brows[forehead & ~where].mean() < 0.02 and seen.hidden[hidden].min() > 0.99


def test_the_parts_of_a_capture_are_read_at_the_size_of_its_maps(tmp_path):
    capture = Capture(tmp_path / "a.wildcap")
    assert shown_parts.read_parts(capture, 32) is None
    images.write_data(capture.texture_parts, np.full((64, 64, 3), [0.2, 0.4, 0.6], np.float32))
    assert shown_parts.read_parts(capture, 32) == pytest.approx(np.full((32, 32, 3), [0.2, 0.4, 0.6]), abs=0.005)
    images.write_data(capture.texture_parts, np.full((64, 64), 0.5, np.float32))
    refused(lambda: shown_parts.read_parts(capture, 32), "parts of a face that grow hair")
