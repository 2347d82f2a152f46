# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The measure of delighters: pictures whose figures are known beforehand, and the floors that are known of the light
stage's photographs."""

import math

import numpy as np
import pytest

pytest.importorskip("flip_evaluator")

from core.capture.messages import Problem  # noqa: E402
from core.face import template  # noqa: E402
from core.imaging import images  # noqa: E402
from core.settings.settings import Settings  # noqa: E402
from research.benchmarks.delighting import (
    delight,
    delight_portraits,  # noqa: E402
)
from research.benchmarks.delighting.delight_measures import FIGURES, score_picture, shortfalls, table, tone_group
from research.benchmarks.delighting.delight_sets import Photograph, Photographs, light_stage  # noqa: E402
from research.benchmarks.maps.albedo_score import AlbedoTruth  # noqa: E402
from research.people.parameters import sample_parameters  # noqa: E402
from research.people.skin import make_skin  # noqa: E402


@pytest.fixture
def truth():
    rng = np.random.default_rng(0)
    albedo = images.linear_to_srgb(0.3 * np.exp(0.1 * rng.standard_normal((300, 300, 3))))
    face = np.zeros((300, 300), bool)
    face[20:280, 20:280] = True
    shadow = np.zeros_like(face)
    shadow[:, 150:] = True
    return AlbedoTruth(0, albedo, face, shadow)


def lit(truth, light):
    return images.linear_to_srgb(images.srgb_to_linear(truth.albedo) * np.asarray(light, np.float32))


def test_the_step_is_measured_only_where_the_light_steps(truth):
    light = np.where(truth.shadow, 0.5, 1.0) * np.ones(truth.face.shape)
    light[150:] = np.where(truth.shadow, 0.95, 1.0)[150:]  # below, the shadow's edge hardly shows
    photograph = lit(truth, light[..., None])
    scored = score_picture(photograph, photograph, truth, features=False)
    assert scored["shadow_step"] == pytest.approx(math.log(2), abs=0.03)
    half_gone = lit(truth, np.sqrt(light)[..., None])
    scored = score_picture(half_gone, photograph, truth, features=False)
    assert scored["shadow_step"] == pytest.approx(math.log(2) / 2, abs=0.03)


def test_the_colour_of_the_light_does_not_count(truth):
    figures = score_picture(lit(truth, [0.5, 0.8, 0.9]), truth.albedo, truth, features=False)
    assert figures["psnr"] > 50 and figures["ssim"] > 0.999 and figures["flip"] < 0.01 and figures["detail"] > 0.999


@pytest.mark.parametrize(
    ("lightness", "b", "group"), [(75, 12, "very light"), (62, 18, "intermediate"), (30, 12, "dark")]
)
def test_tones_fall_into_their_groups(lightness, b, group):
    from skimage.color import lab2rgb

    assert tone_group(lab2rgb(np.array([[[lightness, 8.0, b]]]))[0, 0]) == group


def test_rows_of_a_set_without_a_capture(truth):
    shade = np.where(truth.shadow, 0.5, 1)[..., None]
    photographs = [
        Photograph(name, lit(truth, light), truth, group=name) for name, light in (("one", 0.9), ("two", shade))
    ]
    results = delight.measure_rows(Photographs(photographs), Settings(), features=False, only=["none", "flat"])
    assert results["none"]["pictures"] == 2 and results["none"]["groups"]["one"]["figures"]["psnr"] > 50
    assert results["none"]["groups"]["two"]["figures"]["psnr"] < 30
    assert results["flat true tone"]["figures"]["detail"] == 0
    lines = table({"two lights": results}).splitlines()
    assert len(lines) == 2 + 3 * len(results) and lines[2].startswith("| two lights | none | 2 |")
    assert lines[2 + len(results)].startswith("| two lights: one | none | 1 |")


def test_where_the_network_is_no_better_is_told():
    def row(**figures):
        known = {**dict.fromkeys(FIGURES), **figures}
        return {"pictures": 1, "figures": known, "groups": {"dark": {"pictures": 1, "figures": {**known, "ssim": 0.7}}}}

    network = row(psnr=20, ssim=0.8, flip=0.3, detail=0.4, shadow_step=-0.1)
    results = {
        "set": {
            "none": row(psnr=18, ssim=0.7, flip=0.4, detail=0.6, shadow_step=0.9),
            "shading": {"not_run": "why"},
            "network": network,
        }
    }
    assert shortfalls(results) == ["set: dark: ssim 0.700 of network, 0.700 of none"]
    results["set"]["shading"] = row(psnr=21, ssim=0.7, flip=0.4, shadow_step=-0.05)
    short = {line.split(" of ")[0] for line in shortfalls(results)}
    assert short >= {"set: psnr 20.000", "set: shadow_step -0.100", "set: dark: psnr 20.000"}


def test_a_photograph_that_is_refused_stays_as_it_is(truth, monkeypatch):
    def halves(srgb, settings):
        if srgb.mean() < 0.4:
            raise Problem("It is too dark.", "Take another.")
        return srgb, None

    monkeypatch.setattr(
        delight.delight, "PHOTOGRAPHERS", {"halves": halves, "never": lambda srgb, settings: halves(0 * srgb, settings)}
    )
    photographs = Photographs([Photograph(f"{light}", lit(truth, light), truth) for light in (0.9, 0.1)])
    results = delight.measure_rows(photographs, Settings(), features=False, only=["halves", "never"])
    assert results["halves, one photograph"]["pictures"] == 2 and results["halves, one photograph"]["refused"] == 1
    assert results["never, one photograph"] == {"not_run": "It is too dark. Take another."}


def test_a_folder_without_photographs_is_refused(tmp_path):
    with pytest.raises(Problem, match="holds no photographs"):
        light_stage(tmp_path)
    images.write_srgb(tmp_path / "align_image" / "ann" / "Cam01" / "000.png", np.ones((8, 8, 3)))
    with pytest.raises(Problem, match="lacks align_diffuse/ann_Cam01.png"):
        light_stage(tmp_path)


def test_a_portraits_group_is_that_of_the_skin_as_it_is_painted():
    """Subject 9148 is very light by melanin and blood alone, and light with its saturation, as its painted skin is."""
    skin = make_skin(sample_parameters(9148), 128).diffuse[template.mask("skin", 128) > 0.5].mean(0)
    assert tone_group(images.linear_to_srgb(skin)) == "light"
    seeds = delight_portraits.subjects_by_tone(6)
    assert 9148 in seeds["light"] and 9148 not in seeds["very light"]


def test_a_portrait_is_made_once_and_is_its_albedo_in_some_light(tmp_path, monkeypatch):
    for name, value in {"SIZE": 96, "TEXELS": 128, "subjects_by_tone": lambda count: {"tan": [9110]}}.items():
        monkeypatch.setattr(delight_portraits, name, value)
    (made,) = delight_portraits.make_portraits(tmp_path, lights=1).photographs
    monkeypatch.setattr(delight_portraits, "portrait_parts", None)
    (kept,) = delight_portraits.make_portraits(tmp_path, lights=1).photographs
    assert np.array_equal(made.srgb, kept.srgb) and np.array_equal(made.truth.albedo, kept.truth.albedo)
    face = made.truth.face
    assert made.group == "tan" and face.mean() > 0.05 and (made.truth.albedo[face] > 0.05).all()
    assert made.srgb[face].std() > 0.02
    assert 10 < score_picture(made.srgb, made.srgb, made.truth, features=False)["psnr"] < 40
