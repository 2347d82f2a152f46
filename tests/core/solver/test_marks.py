# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Moles inside a shadow: found, told from freckles, pores and shadow, confirmed by views, and still there after the
real solve, as the shadow's edge is not."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
import torch

from core.capture.capture import Capture
from core.face import template
from core.face.head import read_head
from core.geometry import frame_pictures, meshes
from core.geometry.views import read_views
from core.imaging import images
from core.light.shadow_edges import penumbra
from core.solver.extensions.marks import Mark, find_marks, is_unlike_shadow
from core.solver.recipes import OURS
from core.solver.sampler import Sampler, seed_noise
from core.solver.start import start_solve, tint_face
from core.stages.solve import maps, witnesses
from core.stages.solve.capture_evidence import read_evidence
from core.stages.solve.head_cells import make_head_cells
from core.stages.solve.prior_files import load
from tests.fixtures.photographed_head import write_cameras, write_frames_json

SIZE = 512
TEXEL = 1024 / SIZE
MELANIN = np.array([0.5, 0.8, 1.0])  # what a mole takes of the skin's reflectance, natural log units
TAKEN = np.array([0.62, 0.55, 0.48])  # the share of the light that the shadow takes
TONE = np.array([0.42, 0.26, 0.18], np.float32)
SKIN = np.ones((SIZE, SIZE), bool)


def distance_to(row, column):
    """[SIZE, SIZE], texels of a 1024 map."""
    y, x = np.mgrid[:SIZE, :SIZE]
    return np.hypot(y - row, x - column) * TEXEL


def spot(row, column, diameter):
    return np.clip((diameter / 2 - distance_to(row, column)) / TEXEL + 0.5, 0, 1)[..., None]


def skin(strength=0.05):
    noise = cv2.GaussianBlur(np.random.default_rng(0).normal(size=(SIZE, SIZE)), (0, 0), 1.0)
    return TONE * np.exp(strength * noise / noise.std())[..., None]


@pytest.mark.parametrize("diameter", [6, 10, 16])
def test_a_mole_is_found_where_and_as_large_as_it_is(diameter):
    marks = find_marks(skin() * np.exp(-spot(200, 300, diameter) * MELANIN), SKIN, TEXEL)
    assert len(marks) == 1
    assert np.hypot(marks[0].row - 200, marks[0].column - 300) < 1.5
    assert 0.6 < marks[0].radius * TEXEL / (diameter / 2) < 1.6
    assert 0.6 * MELANIN.mean() < marks[0].contrast < 1.2 * MELANIN.mean()
    assert is_unlike_shadow(marks[0], TAKEN / TAKEN.mean())


def test_freckles_pores_and_shadow_edges_are_no_moles():
    random = np.random.default_rng(1)
    freckles = np.zeros((SIZE, SIZE), np.float32)  # one in 47 square millimetres, 0.8 mm wide, faint to well seen
    freckles[tuple(random.integers(0, SIZE, (2, 1500)))] = random.uniform(0.1, 0.35, 1500)
    freckles = cv2.GaussianBlur(freckles, (0, 0), 1.5 / TEXEL) * (2 * np.pi) * (1.5 / TEXEL) ** 2
    # where several fall on one place
    assert len(find_marks(skin() * np.exp(-freckles[..., None] * MELANIN), SKIN, TEXEL)) <= 5
    assert find_marks(skin(0.12), SKIN, TEXEL) == []
    wavy = 260 + 20 * np.sin(np.arange(SIZE) / 12)
    shadow = (np.arange(SIZE)[:, None] > wavy).astype(float)[..., None]
    assert find_marks(skin() * (1 - shadow * TAKEN), SKIN, TEXEL) == []


def test_a_speck_of_shadow_is_told_by_its_colour():
    marks = find_marks(skin() * (1 - spot(200, 300, 10) * TAKEN), SKIN, TEXEL)
    assert len(marks) == 1 and not is_unlike_shadow(marks[0], TAKEN / TAKEN.mean())


def test_views_confirm_what_they_all_show(tmp_path, monkeypatch):
    """Three cameras before the face: two dots in all pictures but that the second is in one of them only."""
    capture, names = Capture(tmp_path), [f"{i}.jpg" for i in range(3)]
    meshes.write_obj(capture.head, template.load())
    head = read_head(capture)
    marks = [Mark(80.0, column, 2.0, (-0.5, -0.8, -1.0)) for column in (110.0, 146.0)]
    there = head.interpolate(head.mesh.vertices, 256)[80, [110, 146]]
    write_frames_json(capture, names)
    write_cameras(capture.cameras, names, (-11, 0, 11), target=there[0], size=(400, 400), focal=800.0)
    views = read_views(capture)
    for i, view in enumerate(views):
        picture = np.full((400, 400, 3), 0.5, np.float32)
        for pixel in view.project(there)[0][: 2 if i == 0 else 1]:
            cv2.circle(picture, tuple(int(v) for v in pixel), 5, (0.2, 0.2, 0.2), -1)
        images.write_srgb((capture.delit / view.name).with_suffix(".png"), picture)
    assert witnesses.confirm_marks(capture, head, marks, 256) == marks[:1]
    monkeypatch.setattr(frame_pictures, "read_views", lambda capture: views[:1])
    assert witnesses.confirm_marks(capture, head, marks, 256) == marks, "one view is too few to deny the texture"


def test_the_solve_keeps_a_mole_in_a_shadow_and_leaves_no_edge(tmp_path):
    """A mole of 8 texels, as large as a cell of the light's grid, in a shadow with a hard edge under a mask that is 8
    texels too large and beside it."""
    prior, capture = load(), Capture(tmp_path)
    face = tint_face(prior.mean_face, torch.from_numpy(TONE), torch.from_numpy(template.mask("skin", SIZE).copy()))
    row, column = round(0.56 * SIZE), round(0.655 * SIZE)
    albedo = (face[0, :3].permute(1, 2, 0).numpy() + 1) / 2
    albedo = albedo * skin(0.04) / TONE * np.exp(-spot(row, column, 8) * MELANIN)
    away = distance_to(row, column)
    distance = away - 90
    light = 1 - penumbra(distance, np.float32(TEXEL))[..., None] * TAKEN
    images.write_linear(capture.texture, (albedo * light).astype(np.float32))
    images.write_data(capture.texture_confidence, np.ones((SIZE, SIZE), np.float32))
    images.write_data(capture.shadow_mask, (distance_to(row - 1.5, column + 1.5) < 98).astype(np.float32))
    meshes.write_obj(capture.head, template.load())
    evidence, recipe = read_evidence(capture, read_head(capture), SIZE), replace(OURS, guidance="proximal", steps=10)
    start = start_solve(prior, evidence, torch.from_numpy(TONE), 8.0, recipe, make_head_cells)
    assert [(round(m.row / 4), round(m.column / 4)) for m in start.marks] == [(round(row / 4), round(column / 4))]
    sampler = Sampler(prior.of_tone(start.working_tone), start.recipe, seed_noise(0))
    result = maps.finish_maps(sampler.sample(start.observations, start.state), evidence, start)

    def contrast(image):
        log = np.log(np.maximum(image, 1e-3)).mean(-1)
        return log[(away > 9) & (away < 14)].mean() - log[away < 2.8].mean()

    assert 0.8 < contrast(result.diffuse) / contrast(albedo) < 1.2
    error = np.log(np.maximum(result.diffuse, 1e-3) / albedo).mean(-1)
    # six inside the shadow, six outside
    rings = [error[(distance >= d) & (distance < d + 3)].mean() for d in range(-18, 18, 3)]
    inside, outside = np.mean(rings[:4]), np.mean(rings[-4:])
    assert abs(outside - inside) < 0.15 * -np.log(1 - TAKEN).mean()
    assert max(rings) - max(inside, outside) < 0.06 and min(rings) - min(inside, outside) > -0.06, "no outline"
    usual = cv2.resize((prior.mean_face[6].numpy() + 1) / 2, (SIZE, SIZE), interpolation=cv2.INTER_AREA)
    assert np.abs(result.specular - usual).max() < 0.05, "no photograph tells it: no grain of chance"
