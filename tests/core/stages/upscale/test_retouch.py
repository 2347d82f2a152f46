# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stage retouch: what layers show is in the maps, in place and colour, everything else keeps its values; hair that was
painted grows; a tone moves what is not locked; changed skin below is told."""

import json
import shutil

import numpy as np
import pytest

from core.capture import retouch_edits, retouch_layers, stages
from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.face import template
from core.face.skin_weight import read_bare_weight, read_skin_weight
from core.imaging import images
from core.imaging.retouch_import import keep_as_it_is
from core.settings.colour_values import to_linear
from core.settings.settings import Settings, from_json
from core.stages import upscale
from core.stages.upscale import retouch
from tests.fixtures import recorded
from tests.fixtures.delivered import HEAD
from tests.fixtures.hairy_head import painted
from tests.fixtures.refused import refused

LARGE = 1024
TONE = (0.7, 0.55, 0.45)
RED = (0.5, 0.1, 0.15)
CHEEK = 0.62, 0.30
"""v, u: where a beard may grow, and no brow."""


@pytest.fixture(scope="module")
def enlarged(tmp_path_factory) -> Capture:
    """A solved head with brows, and its maps four times as large."""
    capture, maps = Capture(tmp_path_factory.mktemp("retouch") / "é.wildcap"), painted()
    capture.root.mkdir()
    shutil.copyfile(HEAD, capture.head)
    images.write_srgb(capture.maps / "diffuse_albedo.png", images.linear_to_srgb(maps.diffuse), bits=16)
    images.write_linear(capture.maps / "diffuse_albedo.exr", maps.diffuse)
    images.write_data(capture.maps / "specular_albedo.png", maps.specular, bits=16)
    images.write_data(capture.maps / "normal.png", maps.normal * 0.5 + 0.5, bits=16)
    images.write_linear(capture.maps / "shading.exr", maps.shading)
    images.write_data(capture.maps / "confidence.png", maps.confidence)
    entry = recorded.make_entry(figures={"skin_tone_srgb": list(TONE), "skin_tone_source": "scene"})
    capture.json.write_text(json.dumps({"format": 2, "source": "", "stages": {"solve": entry}}))
    settings = from_json({"upscale": {"size": LARGE, "method": "lanczos", "whole_head": False}})
    upscale.run(capture, settings, Reporter("upscale"))
    recorded.record(capture, stages.by_name("upscale"), Settings())
    return capture


@pytest.fixture
def capture(enlarged, tmp_path) -> Capture:
    shutil.copytree(enlarged.root, tmp_path / "é.wildcap")
    return Capture(tmp_path / "é.wildcap")


def add(capture: Capture, at, colour=RED, map_name: str = "albedo", size: int = LARGE, radius: float = 0.02, **changes):
    """A layer with a round spot at (v, u)."""
    row, column = (np.mgrid[:size, :size] + 0.5) / size
    spot = np.hypot(row - at[0], column - at[1]) < radius
    pixels = np.zeros((size, size, 4), np.float32)
    pixels[spot] = (*colour, 1)
    layer = retouch_edits.add_layer(capture, "Spot", map_name, TONE)
    images.write_packed(retouch_layers.picture_of(capture, layer), pixels, bits=16, srgb=map_name == "albedo")
    keep_as_it_is(capture, layer)
    return retouch_edits.change_layer(capture, layer.file, **changes)


def run(capture: Capture) -> Reporter:
    report = Reporter("retouch")
    retouch.run(capture, from_json({"upscale": {"whole_head": False}}), report)
    recorded.record(capture, stages.by_name("retouch"), Settings())
    return report


def brow_hairs(folder) -> int:
    with np.load(folder / stages.STRANDS, allow_pickle=False) as stored:
        return len(stored["brows_points"])


def texel(path, at) -> np.ndarray:
    pixels = images.read_data(path)
    return pixels[int(at[0] * len(pixels)), int(at[1] * len(pixels))]


@pytest.mark.parametrize("size", [256, 1024])
def test_a_spot_is_in_every_map_of_the_set_and_what_is_not_painted_keeps_its_values(capture, size):
    add(capture, CHEEK, size=size)
    run(capture)
    after, before = capture.maps_retouched, capture.maps_4k
    albedo, was = (images.read_data(folder / "diffuse_albedo.png") for folder in (after, before))
    changed = (albedo != was).any(2)
    row, column = (np.mgrid[:LARGE, :LARGE] + 0.5) / LARGE
    away = np.hypot(row - CHEEK[0], column - CHEEK[1])
    assert changed[away < 0.018].all() and not changed[away > 0.02 + 2 / size].any()
    for name in ("diffuse_albedo.png", "clean_albedo.png"):
        assert np.abs(texel(after / name, CHEEK) - RED).max() < 0.03
    linear, linear_was = (images.read_linear(folder / "diffuse_albedo.exr") for folder in (after, before))
    assert np.array_equal(linear[~changed], linear_was[~changed])
    assert np.allclose(linear[changed], images.srgb_to_linear(albedo[changed]), atol=2e-3)
    for name in ("specular_albedo.png", "normal.png", "brows.png", "lashes.png"):
        assert (after / name).read_bytes() == (before / name).read_bytes()
    assert images.bits(after / "diffuse_albedo.png") == 16


def test_gloss_and_relief_are_laid_over_and_normals_stay_unit(capture):
    add(capture, CHEEK, (0.9, 0.9, 0.9), "specular")
    add(capture, CHEEK, (0.8, 0.5, 0.8), "normal", opacity=0.5)
    run(capture)
    assert np.isclose(texel(capture.maps_retouched / "specular_albedo.png", CHEEK), 0.9, atol=1e-3)
    normals = images.read_normals(capture.maps_retouched / "normal.png")
    assert np.abs(np.linalg.norm(normals, axis=2) - 1).max() < 1e-3
    mean = 0.5 * np.array([0.6, 0, 0.6]) + 0.5 * images.read_normals(capture.maps_4k / "normal.png")[634, 307]
    assert np.abs(normals[634, 307] - mean / np.linalg.norm(mean)).max() < 0.02
    name = "diffuse_albedo.png"
    assert (capture.maps_retouched / name).read_bytes() == (capture.maps_4k / name).read_bytes()


def test_brows_that_were_painted_grow_and_those_that_were_healed_do_not(capture):
    area = template.mask("brows", LARGE)
    half = (area > 0.02) & (np.arange(LARGE) < LARGE / 2)  # the person's right brow
    pixels = np.zeros((LARGE, LARGE, 4), np.float32)
    pixels[half] = (*images.read_srgb(capture.maps_4k / "clean_albedo.png")[half].mean(0), 1)
    layer = retouch_edits.add_layer(capture, "No Brow", "albedo", TONE)
    images.write_packed(retouch_layers.picture_of(capture, layer), pixels, bits=16, srgb=True)
    run(capture)
    cover = {}
    for folder in (capture.maps_4k, capture.maps_retouched):
        brows = images.read_mask(folder / "brows.png")
        cover[folder.name] = brows[:, : LARGE // 2].sum(), brows[:, LARGE // 2 :].sum()
    assert cover["maps_retouched"][0] < 0.25 * cover["maps_4k"][0], cover
    assert np.isclose(cover["maps_retouched"][1], cover["maps_4k"][1], rtol=0.1)
    grown, before = (brow_hairs(folder) for folder in (capture.maps_retouched, capture.maps_4k))
    assert grown < 0.75 * before


def test_a_layer_moves_with_the_solved_tone_unless_it_is_locked(capture):
    for locked, at in ((False, CHEEK), (True, (0.62, 0.7))):
        add(capture, at, (0.6, 0.4, 0.3), locked=locked)
    record = capture.read()
    record["stages"]["solve"]["figures"]["skin_tone_srgb"] = now = [0.5, 0.4, 0.3]
    capture.json.write_text(json.dumps(record))
    run(capture)
    path = capture.maps_retouched / "diffuse_albedo.exr"
    colour, gain = np.array(to_linear((0.6, 0.4, 0.3))), np.array(to_linear(now)) / to_linear(TONE)
    assert np.allclose(images.read_linear(path)[634, 307], colour * gain, atol=3e-3)
    assert np.allclose(images.read_linear(path)[634, 716], colour, atol=3e-3)
    weight = read_skin_weight(capture, LARGE)
    assert weight[634, 307] > 0.95 and weight[634, 716] < 0.05, "a later tone leaves the locked one alone"
    bare = read_bare_weight(capture, LARGE)
    assert bare[634, 307] > 0.95 and bare[634, 716] < 0.05, "without hair as well"


def test_skin_that_has_changed_below_is_told_and_the_layer_kept(capture):
    layer = add(capture, CHEEK)
    other = add(capture, (0.62, 0.7))
    assert run(capture).figures["retouch_changed"] == {}
    albedo = images.read_linear(capture.maps / "diffuse_albedo.exr")
    albedo[140:180, 60:100] *= 0.7
    images.write_linear(capture.maps / "diffuse_albedo.exr", albedo)
    images.write_srgb(capture.maps / "diffuse_albedo.png", images.linear_to_srgb(albedo), bits=16)
    report = run(capture)
    assert list(report.figures["retouch_changed"]) == [layer.file] != [other.file]
    assert report.figures["retouch_changed"][layer.file] > 3 and "Spot has changed" in report.findings[0]["problem"]
    assert np.abs(texel(capture.maps_retouched / "diffuse_albedo.png", CHEEK) - RED).max() < 0.03
    assert keep_as_it_is(capture, layer).tone == TONE, "its colours stay"
    assert run(capture).figures["retouch_changed"] == {}


def test_without_shown_layers_the_folder_goes_but_not_what_somebody_put_there(capture):
    layer = add(capture, CHEEK)
    run(capture)
    (capture.maps_retouched / "mine.txt").write_text("mine")
    retouch_edits.change_layer(capture, layer.file, visible=False)
    run(capture)
    assert [path.name for path in capture.maps_retouched.iterdir()] == ["mine.txt"]


def test_a_layer_whose_picture_is_gone_is_told(capture):
    layer = add(capture, CHEEK)
    retouch_layers.picture_of(capture, layer).unlink()
    assert "missing" in run(capture).findings[0]["problem"] and not capture.maps_retouched.exists()


@pytest.mark.parametrize("name", ["normal.png", "specular_albedo.png", "brows.png", "diffuse_albedo.exr"])
def test_a_damaged_map_is_refused_by_name_and_not_copied(capture, name):
    add(capture, CHEEK)
    path = capture.maps_4k / name
    path.write_bytes(path.read_bytes()[:-40])
    refused(lambda: run(capture), name)
    assert not capture.maps_retouched.exists()
