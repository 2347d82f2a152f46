# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A prior of the authors' kind on a capture: maps go to the UVs it works in and come back to where they were, and the
stage gives sensible maps."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from core.capture import stages
from core.capture.stages import MAPS
from core.face import template
from core.geometry import raster
from core.imaging import images
from core.solver.lighting import Lights
from core.stages import solve
from core.stages.solve import layout
from core.stages.solve.maps import Maps
from core.stages.solve.prior_files import load
from tests.fixtures import authors_prior
from tests.fixtures.authors_prior import bridge, front, other_head, put_own_head, settings
from tests.fixtures.painted_skin import SIZE, TONE, make, plain_evidence, solved
from tests.fixtures.recorded import changed, record
from tests.fixtures.refused import refused


@pytest.fixture
def capture(tmp_path):
    """Painted skin, and another head fitted beside the built-in one."""
    made = make(tmp_path / "face.wildcap", (0.6, 0.5), 0.06)
    put_own_head(made, other_head())
    return made


@pytest.fixture
def authors(tmp_path):
    """A folder as the authors' of a network with little to say: random, its output scaled down."""
    cond = {"type": "coord"}
    state = authors_prior.weights_of(authors_prior.MODEL, cond)
    state["inner_model.proj_out.weight"] *= 0.05
    return authors_prior.write(tmp_path / "authors", authors_prior.MODEL, cond, state)


@pytest.fixture(scope="module")
def carried():
    """The layout of the other head at 256, and the built-in head's texels: position [S, S, 3], and which of them are
    far within the window."""
    own, size = other_head(), 256
    there = layout.make_layout(front(), own, np.ones(len(own.faces), bool), size, load().mean_face, lambda done: None)
    face, bary = raster.rasterize_uv(template.load(), size)
    position = raster.interpolate(template.load().vertices, template.load().faces, face, bary).astype(np.float32)
    return there, raster.bleed(position, face >= 0), template.mask("face", size) > 0.9


def round_trip(there: layout.Layout, albedo: np.ndarray, normal: np.ndarray) -> Maps:
    """Maps of the built-in UVs taken to the window's and returned."""
    size, flat = len(albedo), np.ones(there.there.covered.shape, np.float32)
    diffuse = there._there(torch.from_numpy(albedo.transpose(2, 0, 1).copy())).permute(1, 2, 0).numpy()
    turned = layout.baking.bake_normals(normal, there.there)
    solved = Maps(diffuse, flat, turned, np.repeat(flat[..., None], 3, 2), flat, torch.ones(3))
    up = torch.tensor([0.0, 0, 1])[:, None, None].expand(3, size, size)
    evidence = plain_evidence(size, weight=torch.zeros(size, size), normal=up)
    lights = Lights(torch.ones(3, 9), torch.zeros(1, 9, 1, 1), torch.ones(3))
    return there.returned(solved, evidence, lights, 1.0, torch.from_numpy(TONE))


def test_a_smooth_map_survives_both_ways(carried):
    """Stated: within 0.01 of a range of 0.6 at 256 texels, for a wave of about 60 mm; a normal map within half a
    degree, though the chart is turned."""
    there, position, inner = carried
    wave = (0.5 + 0.3 * np.sin(position @ np.array([[95.0, 40, 0], [0, 80, 60], [60, 0, 90]]).T)).astype(np.float32)
    tilted = np.stack([0.3 * np.sin(40 * position[..., 2]), np.full(wave.shape[:2], 0.25), np.ones(wave.shape[:2])], -1)
    tilted = (tilted / np.linalg.norm(tilted, axis=-1, keepdims=True) / 2 + 0.5).astype(np.float32)
    back = round_trip(there, wave, tilted)
    assert there.back.known[inner].mean() > 0.98 and there.fits(template.mask("skin", 256) * inner)
    error = np.abs(back.diffuse - wave)[inner].max(-1)
    assert np.percentile(error, 99) < 0.01, np.percentile(error, [50, 99, 100])
    cosine = ((back.normal * 2 - 1) * (tilted * 2 - 1)).sum(-1)[inner]
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    assert np.median(angle) < 0.5 and np.percentile(angle, 95) < 2
    assert np.percentile(back.confidence[inner], 5) > 0.9 and back.confidence[~there.back.known].max() == 0


def test_the_prior_is_asked_in_its_own_window_and_coordinates(carried):
    there, position, _ = carried
    assert there.there.covered.shape == (192, 192)
    box = layout._box(layout.TONE_BOX, 192) > 0
    assert box.sum() == pytest.approx(110 * 84 * (192 / 768) ** 2, rel=0.05)
    at = there._there(torch.from_numpy(position.transpose(2, 0, 1).copy()))[:, box].mean(1)
    assert np.linalg.norm(at.numpy() - bridge()[0]) < 0.006
    assert layout.round_size(1024, 8) == 1024 and layout.round_size(500, 8) == 480
    assert layout.round_size(1024, 64) * 3 / 4 % 64 == 0


@pytest.mark.parametrize("recipe", ["wildcap", "released"])
def test_the_stage_solves_with_it_and_answers_in_the_built_in_uvs(capture, authors, recipe, monkeypatch):
    monkeypatch.setitem(solve.RECIPES, "released", replace(solve.RECIPES["released"], steps=6, candidates=2, zeta=0.1))
    layouts = authors_prior.seen_layouts(monkeypatch)
    solved(capture, settings(authors, recipe=recipe))
    for name in MAPS:
        values = images.read_data(capture.maps / name)
        assert values.shape[:2] == (SIZE, SIZE) and np.isfinite(values).all(), name
    albedo, shading = (images.read_linear(capture.maps / f"{name}.exr") for name in ("diffuse_albedo", "shading"))
    texture = images.read_linear(capture.texture)
    face = template.mask("face", SIZE) > 0.9
    normal = images.read_data(capture.maps / "normal.png")[..., :3] * 2 - 1
    assert np.abs(np.linalg.norm(normal, axis=-1) - 1).max() < 0.01
    if recipe == "released":  # the tone is that of their box, by the mean of sRGB values
        uv = layouts[0].back.uv
        row, column = (1 - uv[..., 1]) * 768 + 64, uv[..., 0] * 768 + 128
        box = (row > 289) & (row < 399) & (column > 470) & (column < 554)
        assert box.sum() > 20
        assert np.abs((albedo[box] ** (1 / 2.2)).mean(0) / TONE ** (1 / 2.2) - 1).max() < 0.03
    else:
        off = np.abs(albedo * shading - texture)[face].mean()
        assert off < 0.05 * texture[face].mean(), "the texture is explained where it was"
        brows, cheeks = template.mask("brows", SIZE) > 0.7, (template.mask("skin", SIZE) > 0.9) & face
        assert albedo[brows].mean() < 0.9 * albedo[cheeks].mean(), "brows are where brows are"
        skin = template.mask("skin", SIZE) * template.mask("face", SIZE) * (1 - template.mask("eyes", SIZE))
        assert np.abs((albedo * skin[..., None]).sum((0, 1)) / skin.sum() / TONE - 1).max() < 0.03


def test_without_the_other_head_or_with_other_uvs_it_says_what_to_do(capture, authors):
    put_own_head(capture, other_head(180.0))
    refused(lambda: solved(capture, settings(authors)), "not those the authors' prior was trained in")
    capture.own_head.unlink()
    assert "--template" in refused(lambda: solved(capture, settings(authors)), "none was fitted").remedy


def test_another_checkpoint_or_head_makes_the_stage_stale_but_only_with_that_prior(capture, authors):
    stage = stages.by_name("solve")

    def change(prior, edit) -> tuple[str, ...]:
        record(capture, stage, settings(prior))
        edit()
        return changed(capture, stage, settings(prior))

    def edit_config():
        (authors / "config.json").write_text((authors / "config.json").read_text() + "\n")

    assert change("", lambda: put_own_head(capture, other_head(5.0))) == change("", edit_config) == ()
    assert change(authors, lambda: put_own_head(capture, other_head(6.0))) == ("own_head.obj",)
    assert change(authors, edit_config) == ("solve.prior",)
