# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The skin tone's estimate: known tones through known light, no group drawn to another, and a stated deviation that
holds."""

import numpy as np
import pytest
import torch

from core.capture.messages import Reporter
from core.face.head import read_head
from core.settings.colour_values import format_skin_tone, parse_skin_tone
from core.settings.settings import from_json
from core.solver.prior import prior
from core.stages.solve import look, population, prior_files, tone
from core.stages.solve.skin_tone import EARLIER, GIVEN, SCENE, TEXTURE, WHITE_POINT, SkinTone, read_given_tone
from research.training import tones
from tests.fixtures.painted_skin import make, settings
from tests.fixtures.refused import refused

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


@pytest.mark.parametrize("lightness", [68, 28])
def test_with_a_measured_white_a_tone_is_what_it_is(lightness):
    """Of light and dark skin alike: neither exposure nor the light's colour reaches the tone."""
    known = population.read_population()
    true = known.tones[np.abs(population.to_lab(known.tones)[:, 0] - lightness).argmin()]
    shown = (true + population.SHEEN_REFLECTANCE) * BRIGHT
    found = [population.estimate_from_white(gain * shown, gain * BRIGHT) for gain in (0.2, 0.7)]
    assert np.allclose(found[0].linear, found[1].linear, rtol=1e-3)
    assert abs(population.to_lab(np.array(found[0].linear))[0] - lightness) < 4 and 0 < found[0].deviation < 10


def test_the_stated_deviation_holds_and_a_measured_white_draws_nobody_to_the_middle():
    """Held-out subjects in random light before random phones."""
    rows = []
    for seed in range(9000, 9010):
        for k, scene in enumerate(tones.scenes_of(seed)[:2]):
            shown, card = tones.photographed(scene, np.random.default_rng([seed, k]))
            found = population.estimate_from_scene(shown.best, SCENE)
            white = population.estimate_from_white(shown.front, card)
            lightness = population.to_lab(np.array([scene.tone, found.linear, white.linear]))[:, 0]
            rows.append((*lightness, found.deviation))
    light, by_scene, by_white, stated = np.array(rows).T
    signed, measured = by_scene - light, by_white - light
    assert np.mean(np.abs(signed) <= 2 * stated) >= 0.85
    assert np.sqrt(np.mean(np.square(measured))) < 0.6 * np.sqrt(np.mean(signed**2)), "a measured white helps"
    assert abs(np.polyfit(light, measured, 1)[0]) < 0.2


@pytest.mark.parametrize(("gain", "cast"), [(0.02, (1, 1, 1)), (0.3, (1.6, 1, 0.4)), (1.0, (0.7, 1, 1.5))])
def test_no_estimate_leaves_measured_skin_or_is_surer_than_its_colour_lets_it_be(gain, cast):
    """Burnt out, black or under any cast: facial skin was measured between L* 20 and 70, its colour tells L* to 6."""
    found = population.estimate_from_scene(gain * np.array(cast) * [0.9, 0.6, 0.45], SCENE)
    lightness = population.to_lab(np.array(found.linear))[0]
    assert 20 <= lightness <= 70 and found.deviation >= 6


def test_the_population_is_of_measured_people():
    """As the archive's summary has it, less the surface's reflection: one origin of eight is darker than L* 45, and one
    in twenty people of the others; fair skin (L* 58) has a* 14 and b* 16, dark skin (L* 34) a* 12.5 and b* 18."""
    known = population.read_population()
    lab = population.to_lab(known.tones)
    assert known.share.sum() == pytest.approx(1, abs=1e-3) and known.even.sum() == pytest.approx(1)
    assert known.share[lab[:, 0] < 45].sum() == pytest.approx(1 / 8 + 7 / 8 * 0.05, abs=0.03)
    for lightness, a, b in ((58, 14, 16), (34, 12.5, 18)):
        near = np.abs(lab[:, 0] - lightness) < 0.6
        mean = np.average(lab[near], axis=0, weights=known.even[near])
        assert mean[1:] == pytest.approx([a, b], abs=2.5)


@pytest.mark.parametrize(
    ("angle", "name"),
    [(60, "very light"), (48, "light"), (35, "intermediate"), (20, "tan"), (-10, "brown"), (-50, "dark")],
)
def test_groups_by_their_angle(angle, name):
    lightness = 50 + 16 * np.tan(np.radians(angle))
    assert population.name_group(population.from_lab(np.array([lightness, 12.0, 16.0]))) == name


def test_a_tone_is_written_in_shares_in_bytes_or_in_hexadecimal_and_read_again():
    given = read_given_tone("0.69,0.54,0.45")
    assert given.source == GIVEN and given.deviation is None and np.allclose(given.srgb, [0.69, 0.54, 0.45], atol=1e-6)
    assert given.tensor.dtype == torch.float32 and tuple(given.tensor.tolist()) == given.linear
    assert read_given_tone(format_skin_tone(given.srgb)) == given and read_given_tone("auto") is None
    assert parse_skin_tone("176,138,118") == parse_skin_tone("#B08A76") == parse_skin_tone(" b08a76 ")
    assert parse_skin_tone("#B08A76") == pytest.approx((176 / 255, 138 / 255, 118 / 255), abs=5e-5)
    assert parse_skin_tone("1,0.5,0.4") == (1, 0.5, 0.4) and parse_skin_tone("auto") is None
    wrong_numbers = "0.5,0.4 0.5,0.4,0 0.5,0.4,1.1 nan,0.4,0.3 inf,4,3 256,138,118 176,138,-118 176.5,138,118"
    for wrong in ["", "pink", "#B08A7", "#B08A76FF", "0.00001,0.4,0.3", *wrong_numbers.split()]:
        refused(lambda wrong=wrong: parse_skin_tone(wrong), "not a colour")


def test_who_types_the_tone_that_is_reported_gives_the_solve_the_same():
    skin, white = np.array([0.41, 0.27, 0.2]), np.array([0.8, 0.77, 0.7])
    for found, source in (
        (population.estimate_from_scene(skin, SCENE), SCENE),
        (population.estimate_from_white(skin, white), WHITE_POINT),
        (SkinTone.from_linear([0.312345, 0.2, 0.1], TEXTURE), TEXTURE),
    ):
        report = Reporter("solve")
        tone.tell_skin_tone(found, from_json({}), report)
        typed = ",".join(map(str, report.figures["skin_tone_srgb"]))
        assert found.source == source and read_given_tone(typed).linear == found.linear


@pytest.mark.parametrize(
    ("source", "options", "count"),
    [(SCENE, {}, 1), (TEXTURE, {}, 1), (EARLIER, {}, 1), (WHITE_POINT, {"white_point": "1,1,1"}, 0)]
    + [(EARLIER, {"skin_tone": "0.5,0.4,0.3"}, 0)],
)
def test_a_tone_that_only_the_pictures_tell_is_said_to_be_a_guess(source, options, count):
    report = Reporter("solve")
    tone.tell_skin_tone(SkinTone.from_srgb([0.5, 0.4, 0.3], source), from_json({"solve": options}), report)
    assert len(report.findings) == count


def test_a_prior_is_told_a_tone_and_stays_as_it_is():
    ours, coords = prior_files.load(dtype=torch.float32), prior.make_coordinates(1024, slice(480, 512), slice(480, 512))
    x = torch.randn(1, 7, 32, 32, generator=torch.Generator().manual_seed(0))
    before = dict(vars(ours))
    light, dark = (ours.of_tone(tone * torch.tensor([1.0, 0.7, 0.5])) for tone in (0.6, 0.1))
    first = light(x, 1.0, coords)
    assert not torch.equal(dark(x, 1.0, coords), first) and torch.equal(light(x, 1.0, coords), first)
    assert all(vars(ours)[name] is value for name, value in before.items()) and len(before) == len(vars(ours))


def test_the_artists_tone_wins_and_a_capture_without_cameras_asks_its_texture(tmp_path):
    capture, report = make(tmp_path / "a.wildcap"), Reporter("solve")
    head = read_head(capture)
    evidence = tone.read_evidence(capture, head, 64)
    told = tone.resolve_skin_tone(capture, head, settings(skin_tone="0.5,0.4,0.3"), evidence, report)
    assert told == SkinTone.from_srgb([0.5, 0.4, 0.3], GIVEN)
    found = tone.resolve_skin_tone(capture, head, settings(skin_tone="auto"), evidence, report)
    assert found.source == TEXTURE and found.deviation >= 6
    tone.run(capture, from_json({}), report)
    assert report.figures["skin_tone_source"] == "texture"
