# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The skin tone's estimate: known tones through known light, no group drawn to another, and a stated deviation that
holds."""

import numpy as np
import pytest

pytest.importorskip("torch")
import torch

from core.contract.messages import Problem, Reporter
from core.contract.settings import from_json
from core.face.head import read_head
from core.solve import look, population, prior, tone
from core.solve.skin_tone import GIVEN, SCENE, TEXTURE, WHITE_POINT, SkinTone, format_skin_tone, parse_skin_tone
from core.training import tones

BRIGHT = np.array([1.4, 1.3, 1.2])


def sphere(count: int = 600) -> np.ndarray:
    """Unit normals [count, 3] of a half that faces -Y."""
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(normals[:, 1:2] > 0, normals * [1, -1, 1], normals)


def test_the_front_of_smoothly_lit_skin_is_found_past_shadows_and_highlights():
    normals = sphere()
    lit = (0.6 - 0.3 * normals[:, 1] + 0.2 * normals[:, 0])[:, None] * np.array([0.5, 0.3, 0.2])
    lit[::9] *= 0.4  # in shadow
    lit[4::31] += 0.5  # a highlight
    found = look.summarise_look(lit, normals, np.ones(len(lit)))
    assert np.allclose(found.front, 0.9 * np.array([0.5, 0.3, 0.2]), rtol=0.03)
    assert np.allclose(found.best / found.best[1], [5 / 3, 1, 2 / 3], rtol=0.08) and found.best[1] > found.front[1]


def test_highlights_that_move_do_not_count():
    seen = np.full((5, 40, 3), 0.3)
    seen[np.arange(5), np.arange(5) * 8] = 0.9
    seen[:4, 39] = np.nan
    assert np.allclose(look._low_quantile(seen), 0.3)


@pytest.mark.parametrize("reflects", [0.6, 0.3, 0.12, 0.05])
def test_with_a_measured_white_a_tone_is_what_it_is(reflects):
    """Of light and dark skin alike: neither exposure nor the light's colour reaches the tone."""
    known = population.read_population()
    true = known.tones[np.abs(known.tones[:, 0] - reflects).argmin()]
    shown = (true + population.SHEEN_REFLECTANCE) * BRIGHT
    found = [population.estimate_skin_tone(look.Look(gain * shown, gain * shown), white=gain * BRIGHT)
             for gain in (0.2, 0.7)]
    assert np.allclose(found[0].linear, found[1].linear, rtol=1e-3)
    lightness = population.to_lab(np.array(found[0].linear))[0]
    assert abs(lightness - population.to_lab(true)[0]) < 4 and 0 < found[0].deviation < 10


def test_the_stated_deviation_holds_and_no_group_is_drawn_to_the_middle():
    """Held-out subjects in random light before random phones."""
    signed, stated, light, measured = [], [], [], []
    for seed in range(9000, 9014):
        for k, scene in enumerate(tones.scenes_of(seed)[:2]):
            shown, card = tones.photographed(scene, np.random.default_rng([seed, k]))
            true = population.to_lab(scene.tone)[0]
            found = population.estimate_skin_tone(shown)
            signed.append(population.to_lab(np.array(found.linear))[0] - true)
            measured.append(population.to_lab(np.array(population.estimate_skin_tone(shown, card).linear))[0] - true)
            stated.append(found.deviation)
            light.append(true)
    signed, stated, light = np.array(signed), np.array(stated), np.array(light)
    assert np.mean(np.abs(signed) <= 2 * stated) >= 0.85
    assert np.sqrt(np.mean(np.square(measured))) < np.sqrt(np.mean(signed**2)), "a measured white helps"
    assert abs(np.polyfit(light, signed, 1)[0]) < 0.3, (
        "light skin does not come out darker nor dark skin lighter by much of the difference"
    )


def test_groups_by_their_angle():
    from core.solve.population import from_lab, name_group

    for angle, name in ((60, "very light"), (48, "light"), (35, "intermediate"), (20, "tan"), (-10, "brown"),
                        (-50, "dark")):
        lightness = 50 + 16 * np.tan(np.radians(angle))
        assert name_group(from_lab(np.array([lightness, 12.0, 16.0]))) == name


def test_a_setting_is_a_tone_and_a_tone_a_setting():
    told = parse_skin_tone("0.69,0.54,0.45")
    assert told.source == GIVEN and told.deviation is None and np.allclose(told.srgb, [0.69, 0.54, 0.45], atol=1e-6)
    assert told.tensor.dtype == torch.float32 and tuple(told.tensor.tolist()) == told.linear
    assert parse_skin_tone(format_skin_tone(told)) == told and parse_skin_tone("auto") is None
    for wrong in ("pink", "0.5,0.4", "0.5,0.4,0", "0.5,0.4,1.1", "nan,0.4,0.3", ""):
        with pytest.raises(Problem, match="not a colour"):
            parse_skin_tone(wrong)


def test_who_types_the_estimated_tone_gives_the_solve_the_same():
    shown, white = look.Look(np.array([0.41, 0.27, 0.2]), np.array([0.35, 0.22, 0.17])), np.array([0.8, 0.77, 0.7])
    for found, source in ((population.estimate_skin_tone(shown), SCENE),
                          (population.estimate_skin_tone(shown, white), WHITE_POINT)):
        assert found.source == source and found.group and found.deviation > 0 and found.error > 0
        assert parse_skin_tone(format_skin_tone(found)).linear == found.linear


def test_a_prior_is_told_a_tone_and_stays_as_it_is():
    ours, coords = prior.load(dtype=torch.float32), prior.make_coordinates(1024, slice(480, 512), slice(480, 512))
    x = torch.randn(1, 7, 32, 32, generator=torch.Generator().manual_seed(0))
    before = dict(vars(ours))
    light, dark = (ours.of_tone(SkinTone((tone, 0.7 * tone, 0.5 * tone), GIVEN)) for tone in (0.6, 0.1))
    first = light(x, 1.0, coords)
    assert not torch.equal(dark(x, 1.0, coords), first) and torch.equal(light(x, 1.0, coords), first)
    assert all(vars(ours)[name] is value for name, value in before.items()) and len(before) == len(vars(ours))


def test_the_artists_tone_wins_and_a_capture_without_cameras_asks_its_texture(tmp_path):
    from .painted_skin import make, settings

    capture, report = make(tmp_path / "a.wildcap"), Reporter("solve")
    head = read_head(capture)
    evidence = tone.read_evidence(capture, head, 64)
    told = tone.resolve_skin_tone(capture, head, settings(skin_tone="0.5,0.4,0.3"), evidence, evidence, [], report)
    assert told == SkinTone.from_srgb([0.5, 0.4, 0.3], GIVEN)
    found = tone.resolve_skin_tone(capture, head, settings(skin_tone="auto"), evidence, evidence, [], report)
    assert found.source == TEXTURE and not report.figures
    tone.run(capture, from_json({}), report)
    assert report.figures["skin_tone_source"] == "texture"
