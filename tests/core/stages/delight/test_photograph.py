# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A single photograph: the head that its landmarks show, what geometry is worth to the network, and brows that stay."""

import importlib
from types import SimpleNamespace

import numpy as np
import pytest

from core.capture.messages import Problem
from core.face import template
from core.face.faces import BROW_LINES, EYE_LINES, Face
from core.face.head import Head
from core.face.landmark_model import template_landmarks
from core.geometry import raster
from core.geometry.views import read_views
from core.imaging import images
from core.stages.delight.evening import ShadingEstimate
from core.stages.delight.surface import skin_weights
from tests.fixtures.lit_head import SUN_COLOUR, make, render_frames
from tests.fixtures.refused import refused

photograph = importlib.import_module("core.stages.delight.photograph")
IDENTITY = np.random.default_rng(5).normal(0, 0.7, len(template_landmarks().basis))
SIDE, BRIGHT, DARK = 256, 0.5, 0.25
OF_BROW = float(images.srgb_to_linear(np.float32(DARK)) / images.srgb_to_linear(np.float32(BRIGHT)))


def face_at(pixels: np.ndarray) -> Face:
    landmarks = np.concatenate([pixels, np.zeros((468, 1))], 1).astype(np.float32)
    return Face((*pixels.min(0), *pixels.max(0)), landmarks, 1.0)


def parts_of(**shares: np.ndarray) -> SimpleNamespace:
    """What the parser would see, where shares [H, W] are given; nothing else."""
    nothing = 0 * next(iter(shares.values()))
    return SimpleNamespace(of=lambda *names: sum((shares.get(name, nothing) for name in names), nothing))


def test_the_head_that_landmarks_show_lies_under_them_from_where_they_were_seen(tmp_path):
    picture, true = np.full((320, 240, 3), 0.5, np.float32), template_landmarks().shape(IDENTITY)
    for view in read_views(make(tmp_path / "two", (-30, 10))):
        pixels, _ = view.project(true + np.random.default_rng(1).normal(0, 0.0003, true.shape))
        fitted, head = photograph.fit_head(picture, pixels)
        miss = np.linalg.norm(fitted.project(template.landmark_points(head.mesh))[0] - pixels, axis=1)
        assert np.median(miss[template.landmark_weights() > 0.2]) < 0.01 * np.ptp(pixels[:, 0])
        turned = fitted.rotation @ view.rotation.T
        assert np.degrees(np.arccos((np.trace(turned) - 1) / 2)) < 5
        assert fitted.read() is picture


def test_the_light_of_a_photograph_leaves_the_better_for_the_head_that_is_fitted(tmp_path, monkeypatch):
    """Skin of one colour under a sky and a sun from the side: how unlike it comes out, beside the picture and beside
    the network alone."""
    capture, mesh = make(tmp_path / "one", (-10,), (180, 240)), template.load()
    (on_head,), (view,) = render_frames(capture, SUN_COLOUR), read_views(capture)
    srgb, marks = view.read(), template.landmark_points(mesh)
    monkeypatch.setattr(photograph.faces, "detect", lambda srgb: face_at(view.project(marks)[0]))
    monkeypatch.setattr(photograph.parser, "parse", lambda srgb, landmarks: parts_of(skin=on_head.astype(np.float32)))
    face, bary, _ = raster.render_view(raster.RayCaster(mesh), view)
    skin = raster.interpolate(skin_weights(Head(mesh))[0][:, None], mesh.faces, face, bary)[..., 0] > 0.9

    def spread(picture: np.ndarray) -> float:
        log = np.log(np.maximum(images.srgb_to_linear(picture)[skin], 1e-3))
        return float((log - log.mean(0)).std())

    ours = spread(photograph.delight_photograph(srgb, None)[0])

    def refuse(*_):
        raise Problem("The selected frames show no bare skin of the face.", "")

    monkeypatch.setattr(photograph, "fit_lit_head", refuse)
    alone = spread(photograph.delight_photograph(srgb, None)[0])
    assert ours < 0.85 * alone and ours < 0.15 * spread(srgb)


@pytest.mark.parametrize("sees", [True, False])
def test_a_brow_stays_where_the_parser_sees_one_and_where_only_landmarks_tell_of_it(monkeypatch, sees):
    """A network that takes two dark bars for shadow: the one that is a brow stays dark in the albedo, the other
    leaves."""
    picture = np.full((SIDE, SIDE, 3), BRIGHT, np.float32)
    brow, shadow = (slice(90, 102), slice(80, 120)), (slice(160, 172), slice(80, 120))
    picture[brow] = picture[shadow] = DARK
    pixels = np.array([(x, y) for x in (60, 200) for y in (60, 200)] * 117, np.float64)
    for lines, middle, half in ((BROW_LINES, (100, 96), (21, 7)), (EYE_LINES, (160, 96), (8, 4))):
        for line in lines:
            turn = np.linspace(0, 2 * np.pi, len(line), endpoint=False)
            pixels[list(line)] = middle + half * np.stack([np.cos(turn), np.sin(turn)], -1)
    dark = np.zeros((SIDE, SIDE), np.float32)
    dark[brow] = sees
    monkeypatch.setattr(photograph.faces, "detect", lambda srgb: face_at(pixels))
    monkeypatch.setattr(photograph.parser, "parse", lambda srgb, landmarks: parts_of(brows=dark, skin=1 - dark))

    def ask(srgb, points):
        box = photograph.square_around(points)
        log = np.log(images.srgb_to_linear(photograph.crop(srgb, box, 128)))
        return ShadingEstimate(box, log, 0 * log[..., 0], log)

    monkeypatch.setattr(photograph, "_ask", ask)
    albedo = images.srgb_to_linear(photograph.delight_photograph(picture, None)[0])
    skin = albedo[130, 100].mean()
    assert albedo[96, 100].mean() / skin == pytest.approx(OF_BROW, rel=0.1)
    assert albedo[166, 100].mean() / skin == pytest.approx(1, rel=0.1)


def test_a_photograph_without_a_face_is_refused(monkeypatch):
    monkeypatch.setattr(photograph.faces, "detect", lambda srgb: None)
    refused(lambda: photograph.delight_photograph(np.zeros((64, 64, 3), np.float32), None), "No face")
