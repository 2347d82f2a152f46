# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The proposal of the shadow mask against painted shadows: found where they are, and nothing found where there are
none."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
import pycolmap
import pytest

from core.capture.capture import Capture
from core.capture.files import write_json
from core.capture.messages import Reporter
from core.face import template
from core.geometry import meshes, raster
from core.imaging import images
from core.settings.settings import from_json
from core.stages.shadow_mask import run, share_on_edges
from core.stages.shadow_mask.tidy import tidy
from research.benchmarks.shadow_mask import scores

SIZE = 256
SKIN = np.array([0.42, 0.25, 0.18])
SHADOW = np.array([0.40, 0.50, 0.60])  # what is left of the light: the sky's part, bluish


@pytest.fixture
def capture(tmp_path) -> Capture:
    """A capture with a head, no frames, and a texture yet to be written."""
    capture = Capture(tmp_path / "face.wildcap")
    meshes.write_obj(capture.head, template.load())
    capture.cameras.mkdir()
    pycolmap.Reconstruction().write_binary(str(capture.cameras))
    write_json(capture.frames_json, {"frames": []})
    images.write_data(capture.texture_confidence, np.ones((SIZE, SIZE), np.float32))
    return capture


@cache
def skin_texture(seed: int = 0) -> np.ndarray:
    """Linear [S, S, 3]: mottled skin with dark brows and red lips under an even, slightly slanted light."""
    rng = np.random.default_rng(seed)
    mottle = cv2.GaussianBlur(rng.normal(0, 1, (SIZE, SIZE)).astype(np.float32), (0, 0), 4)
    texture = SKIN * np.exp(0.06 * mottle / mottle.std())[..., None]
    head = template.load()
    face, bary = raster.rasterize_uv(head, SIZE)
    normal = raster.interpolate(meshes.vertex_normals(head), head.faces, face, bary)
    texture = texture * (1 + 0.2 * normal[..., :1] - 0.15 * normal[..., 1:2] + 0.15 * normal[..., 2:])
    lips, brows = (template.mask(name, SIZE)[..., None] for name in ("lips", "brows"))
    return texture * (1 - lips) * (1 - 0.8 * brows) + lips * [0.33, 0.12, 0.11]


def proposed(capture: Capture, texture: np.ndarray, **settings) -> np.ndarray:
    images.write_linear(capture.texture, texture)
    run(capture, from_json({"delight": {"delighter": "shading"}, "shadow_mask": settings}), Reporter("shadow_mask"))
    return images.read_mask(capture.shadow_mask_auto)


def painted_blob(centre: tuple[float, float], radius: float) -> np.ndarray:
    """Soft disc [S, S]; centre (column, row) and radius as shares of the map."""
    y, x = np.mgrid[0:SIZE, 0:SIZE]
    return np.clip((radius * SIZE - np.hypot(x - centre[0] * SIZE, y - centre[1] * SIZE)) / 3 + 0.5, 0, 1)


def cheek(side: int) -> tuple[float, float]:
    """UV place (column, row) of the person's left (+1) or right (-1) cheek, from the head's geometry alone."""
    head = template.load()
    face, bary = template.landmarks()
    points = (head.vertices[head.faces[face]] * bary[..., None]).sum(1)
    uv = (head.uvs[head.face_uvs[face]] * bary[..., None]).sum(1)
    nose, mouth = points[4], points[13]
    target = np.array([nose[0] + side * 0.045, nose[1] + 0.03, (nose[2] + mouth[2]) / 2])
    u, v = uv[np.linalg.norm(points - target, axis=1).argmin()]
    return u, 1 - v


def test_painted_shadow_is_found(capture):
    blob = np.maximum(painted_blob(cheek(1), 0.10), painted_blob((0.5, 0.25), 0.09))
    texture = skin_texture()
    found = proposed(capture, texture * (1 - blob[..., None] * (1 - SHADOW)), dilate_px=0) > 0.5
    truth = (blob > 0.5) & (template.mask("face", SIZE) > 0.5)
    assert (found & truth).sum() / (found | truth).sum() > 0.6


def test_even_skin_of_every_tone_gives_an_almost_empty_mask(capture):
    face = template.mask("face", SIZE) > 0.5
    for tone in (0.25, 0.6, 1.4):
        assert proposed(capture, tone * skin_texture())[face].mean() < 0.02


def test_shadow_on_the_left_cheek_is_masked_on_the_left_cheek(capture):
    masks = {
        side: proposed(capture, skin_texture() * (1 - painted_blob(cheek(side), 0.11)[..., None] * (1 - SHADOW)))
        for side in (-1, 1)
    }
    for side, mask in masks.items():
        columns = mask[:, SIZE // 2 :].sum(), mask[:, : SIZE // 2].sum()  # the person's left is at u > 0.5
        assert columns[0 if side > 0 else 1] > 20 * columns[1 if side > 0 else 0]


def test_a_beard_that_the_parser_saw_in_the_frames_is_no_shadow(capture):
    """A chin as dark as a shadow: by its darkness alone it is taken for one."""
    chin = painted_blob((0.5, 0.86), 0.12) * (template.mask("skin", SIZE) > 0.5)
    texture = skin_texture() * (1 - chin[..., None] * 0.8)
    beard = (chin > 0.5) & (template.mask("face", SIZE) > 0.5)
    assert beard.sum() > 500 and proposed(capture, texture, dilate_px=0)[beard].mean() > 0.5
    images.write_data(capture.texture_parts, np.stack([0 * chin, chin, 0 * chin], -1).astype(np.float32))
    assert proposed(capture, texture, dilate_px=0)[beard].mean() < 0.05


@pytest.mark.parametrize("sure, sides, taken_for_shadow", [(0.6, 2, False), (0.75, 1, True), (0.45, 2, True)])
def test_stubble_grows_on_both_sides_and_a_hard_shadow_falls_on_one(capture, sure, sides, taken_for_shadow):
    cheeks = [painted_blob(cheek(side), 0.10) for side in (-1, 1)[-sides:]]
    dark = sum(cheeks).clip(0, 1).astype(np.float32)
    texture = skin_texture() * (1 - dark[..., None] * (1 - SHADOW))
    images.write_data(capture.texture_parts, np.stack([0 * dark, sure * dark, 0 * dark], -1).astype(np.float32))
    mask = proposed(capture, texture, dilate_px=0)[dark > 0.9].mean()
    assert (mask > 0.5) == taken_for_shadow


def test_dilation_grows_with_the_setting_and_nothing_else_changes(capture):
    texture = skin_texture() * (1 - painted_blob(cheek(1), 0.10)[..., None] * (1 - SHADOW))
    areas = [proposed(capture, texture, dilate_px=px).sum() for px in (0, 8, 32)]
    assert areas[0] < areas[1] < areas[2]
    assert not capture.shadow_mask.exists()  # the artist's file is not ours to write


def test_specks_go_and_edges_are_soft():
    hard = np.zeros((512, 512), bool)
    hard[100:104, 100:104] = True  # a mole
    hard[200:300, 200:300] = True
    mask = tidy(hard, np.ones_like(hard), 4)
    assert mask[102, 102] == 0 and mask[250, 250] == 1
    edge = mask[250, 180:205]
    assert ((edge > 0.1) & (edge < 0.9)).any() and mask[250, 197] == 1


def test_the_share_of_a_border_on_edges_is_one_at_most():
    disc = painted_blob((0.5, 0.5), 0.2)
    half = np.repeat(np.arange(SIZE)[None] < SIZE // 2, SIZE, 0).astype(np.float32)
    assert share_on_edges(disc, np.ones_like(disc)) == 1
    assert share_on_edges(disc, half) == pytest.approx(0.5, abs=0.02)
    assert share_on_edges(disc, 0 * disc) == share_on_edges(0 * disc, half) == 0


def test_the_report_says_how_much_of_the_border_was_laid_on_edges(capture):
    blob = painted_blob((0.5, 0.25), 0.09)
    texture = skin_texture() * (1 - blob[..., None] * (1 - SHADOW))
    images.write_linear(capture.texture, texture)
    report = Reporter("shadow_mask")
    run(capture, from_json({"delight": {"delighter": "shading"}}), report)
    assert 50 < report.figures["laid_on_edges_percent"] <= 100


def test_the_benchmark_s_scores_of_masks_with_known_overlap():
    disc, shifted = (painted_blob(centre, 0.2) > 0.5 for centre in ((0.5, 0.5), (0.52, 0.5)))
    half = disc & (np.arange(SIZE) < SIZE // 2)
    everywhere = np.ones_like(disc)
    assert scores(disc, disc, everywhere)[2:] == (1, 1, 1, 1)
    assert scores(half, disc, everywhere)[2:5] == pytest.approx((0.5, 1, 0.5), abs=0.02)
    # by 20 texels of a 1024 map: only where the borders cross do they meet
    assert scores(shifted, disc, everywhere)[5] < 0.4
    assert scores(~disc, disc, everywhere)[2:5] == (0, 0, 0)
