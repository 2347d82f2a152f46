# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The skin tone's estimate: known tones through known light, no group drawn to another, and a stated deviation that
holds."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from core.capture.frame_records import FrameRecord
from core.capture.messages import Reporter
from core.face.eye_reader import EyeShares
from core.face.head import read_head
from core.settings.colour_values import format_skin_tone, parse_skin_tone
from core.settings.settings import from_json
from core.settings.skin_swatches import make_swatches
from core.solver.prior import prior
from core.solver.start import NoSkinError
from core.stages.solve import look, population, prior_files, tone
from core.stages.solve.look import Eyes, Look, to_coordinates
from core.stages.solve.skin_tone import (
    COLOURLESS,
    EARLIER,
    EYES,
    GIVEN,
    SCENE,
    STRANGE,
    TEXTURE,
    WHITE_POINT,
    SkinTone,
    read_given_tone,
)
from tests.fixtures.painted_skin import make, settings
from tests.fixtures.refused import refused

BRIGHT = np.array([1.4, 1.3, 1.2])
CAST = np.array([1.3, 1.0, 0.8])


def tone_of(lightness: float) -> np.ndarray:
    """A measured tone [3] of this L*."""
    tones = population.read_population().tones
    return tones[np.abs(population.to_lab(tones)[:, 0] - lightness).argmin()]


def shown(cue: population.Cue, tone: np.ndarray) -> np.ndarray:
    """What a cue shows of a tone in the mean."""
    return cue.slope @ to_coordinates(tone + population.SHEEN_REFLECTANCE) + cue.offset


def look_of(tone: np.ndarray, gain: np.ndarray | float = 1.0, unevenness: float = 0.5, burnt: float = 0.0) -> Look:
    """The look of a tone in a usual picture, times a gain, with whites that lost so much by burning out, natural log."""
    people = population.read_population()
    over_white = shown(people.over_white, tone) + [burnt, 0, 0]
    skin = shown(people.skin, tone) + to_coordinates(np.ones(3) * gain)
    return Look(skin, unevenness, Eyes(over_white, unevenness, burnt > 0))


def lightness_of(estimate: SkinTone) -> float:
    return float(population.to_lab(np.array(estimate.linear))[0])


def test_neither_shadow_nor_highlight_counts_in_a_mean_between_quantiles():
    colours = np.tile([0.5, 0.3, 0.2], (100, 1))
    colours[:9], colours[91:] = 0.01, 1.0
    assert np.allclose(look.mean_between(colours, (0.1, 0.9)), [0.5, 0.3, 0.2])


def test_a_persons_look_is_the_median_of_the_pictures_that_show_it():
    looks = [Look(np.full(3, v), v, None if v == 3 else Eyes(np.full(3, -v), 2 * v)) for v in (1.0, 2.0, 9.0, 3.0)]
    merged = look.merge_looks([*looks, None])
    assert np.allclose(merged.skin, 2.5) and merged.unevenness == 2.5
    assert np.allclose(merged.eyes.over_white, -2) and merged.eyes.unevenness == 4 and not merged.eyes.burnt
    assert look.merge_looks([looks[3]]).eyes is None and look.merge_looks([None]) is None


def test_burnt_whites_count_where_no_picture_shows_others():
    burnt, whole = (Look(np.zeros(3), 0.5, Eyes(np.full(3, v), 0.5, v > 0)) for v in (1.0, -1.0))
    assert np.allclose(look.merge_looks([burnt, whole, burnt]).eyes.over_white, whole.eyes.over_white)
    assert look.merge_looks([burnt, burnt]).eyes.burnt


def test_a_white_whose_brightest_part_is_burnt_is_read_in_a_darker_one(monkeypatch):
    """A white that falls off as usual people's do reads the same at any exposure, until most of it is burnt."""
    quantiles = (np.arange(900) + 0.5) / 900
    middles = [np.mean(band) for band, _ in look.WHITE_BANDS][::-1]
    level = np.exp(-np.interp(quantiles, middles, [darker for _, darker in look.WHITE_BANDS][::-1]))
    eye = EyeShares(np.ones((30, 30)), np.zeros((30, 30)), np.eye(2, 3))
    monkeypatch.setattr(look.eye_reader, "read_eye", lambda *arguments: eye)

    def read(gain: float) -> tuple[np.ndarray, bool]:
        linear = np.clip(gain * level, 0, 1).reshape(30, 30, 1).repeat(3, 2).astype(np.float32)
        coordinates, burnt = look._read_white(linear, linear, np.zeros((2, 2)), False)
        return coordinates[0] - np.log(gain), burnt

    for gain in (0.2, 0.8, 1.1, 1.3):
        assert read(gain) == (pytest.approx(0, abs=0.06), False)
    assert read(3.0)[1], "brighter than it was read"


def test_eyes_are_looked_at_in_frames_from_in_front_that_are_no_blinks():
    def record(yaw: float | None, blink: bool = False) -> FrameRecord:
        box = None if yaw is None else (0, 0, 9, 9)
        return FrameRecord(name=f"{yaw}", sharpness=1, selected=False, face_box=box, yaw_deg=yaw, blink=blink)

    film = (record(50), record(-10), record(None), record(3), record(5, blink=True))
    assert [each.yaw_deg for each in look._frontal(film)] == [3, -10]
    assert [each.yaw_deg for each in look._frontal((record(50), record(None)))] == [50]
    assert len(look._frontal(tuple(record(n) for n in range(30)))) == look.MAX_PICTURES


@pytest.mark.parametrize("lightness", [68, 28])
def test_with_a_measured_white_a_tone_is_what_it_is(lightness):
    """Of light and dark skin alike: neither exposure nor the light's colour reaches the tone."""
    skin = (tone_of(lightness) + population.SHEEN_REFLECTANCE) * BRIGHT
    by_gain = [
        population.estimate_from_white(Look(to_coordinates(gain * skin), 0.5), gain * BRIGHT) for gain in (0.2, 0.7)
    ]
    assert np.allclose(by_gain[0].linear, by_gain[1].linear, rtol=1e-3)
    assert abs(lightness_of(by_gain[0]) - lightness) < 5 and 0 < by_gain[0].deviation < 10


@pytest.mark.parametrize("lightness", [62, 45, 28])
def test_the_whites_of_the_eyes_hold_the_tone_at_any_exposure_and_white_balance(lightness):
    tone = tone_of(lightness)
    for gain in (0.5, 1, 2, CAST):
        estimate = population.estimate_from_look(look_of(tone, gain))
        assert estimate.source == EYES and abs(lightness_of(estimate) - lightness) < 4
    without = [lightness_of(population.estimate_from_look(Look(look_of(tone, gain).skin))) for gain in (0.5, 2)]
    assert without[1] - without[0] > 8, "without them exposure is all there is"


def test_burnt_whites_bound_a_tone_from_above():
    """A dark face that a phone exposed for itself alone: brightness says fair, and that its whites are burnt, dark."""
    tone = tone_of(30)
    bright = look_of(tone, gain=3.0, burnt=0.4)
    bound, taken = (
        lightness_of(population.estimate_from_look(replace(bright, eyes=replace(bright.eyes, burnt=burnt))))
        for burnt in (True, False)
    )
    assert bound < taken - 2 and bound < lightness_of(population.estimate_from_look(replace(bright, eyes=None))) - 5


def test_an_uneven_light_and_missing_eyes_widen_what_is_stated():
    tone = tone_of(50)
    even, uneven = (population.estimate_from_look(look_of(tone, unevenness=u)) for u in (0.3, 2.0))
    without = population.estimate_from_look(replace(look_of(tone), eyes=None))
    assert even.deviation < uneven.deviation < 20 and even.deviation < without.deviation and without.source == SCENE


@pytest.mark.parametrize(("gain", "cast"), [(0.02, (1, 1, 1)), (0.3, (1.6, 1, 0.4)), (1.0, (0.7, 1, 1.5))])
def test_no_estimate_leaves_measured_skin(gain, cast):
    """Burnt out, black or under any cast: facial skin was measured between L* 20 and 70."""
    estimate = population.estimate_from_look(Look(to_coordinates(gain * np.array(cast) * [0.9, 0.6, 0.45])))
    assert 20 <= lightness_of(estimate) <= 70 and estimate.deviation >= 6


@pytest.mark.parametrize(
    ("ratios", "source"), [((0.01, -0.02), COLOURLESS), ((-0.8, 1.2), STRANGE), ((0.5, -0.3), SCENE)]
)
def test_a_film_without_colour_or_of_colours_that_no_skin_has_is_told(ratios, source):
    """Its brightness still counts, its colours do not: the tone has those of measured skin."""
    estimate = population.estimate_from_look(Look(np.array([-1.2, *ratios])))
    report = Reporter("solve")
    tone.tell_skin_tone(estimate, from_json({}), report)
    red, green, blue = estimate.linear
    assert estimate.source == source and red > 1.2 * green > 1.2 * blue
    assert len(report.findings) == (1 if source == SCENE else 2)


def test_the_population_is_of_measured_people():
    """As the archive's summary has it, less the surface's reflection: fair skin (L* 58) has a* 14 and b* 16, dark skin
    (L* 34) a* 12.5 and b* 18; every lightness counts alike."""
    people = population.read_population()
    lab = population.to_lab(people.tones)
    assert people.prior.sum() == pytest.approx(1)
    assert people.prior[lab[:, 0] < 45].sum() == pytest.approx(0.5, abs=0.02)
    for lightness, a, b in ((58, 14, 16), (34, 12.5, 18)):
        near = np.abs(lab[:, 0] - lightness) < 0.6
        mean = np.average(lab[near], axis=0, weights=people.prior[near])
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
    assert [parse_skin_tone(text) for text in ("1", " 6 ", "10")] == [1, 6, 10] and read_given_tone("6") is None
    wrong_numbers = "0.5,0.4 0.5,0.4,0 0.5,0.4,1.1 nan,0.4,0.3 inf,4,3 256,138,118 176,138,-118 176.5,138,118"
    for wrong in ["", "0", "11", "6.5", "-6", "pink", "#B08A7", "#B08A76FF", "0.00001,0.4,0.3", *wrong_numbers.split()]:
        refused(lambda wrong=wrong: parse_skin_tone(wrong), "not a colour")


def test_who_types_the_tone_that_is_reported_gives_the_solve_the_same():
    skin, white = Look(to_coordinates(np.array([0.41, 0.27, 0.2]))), np.array([0.8, 0.77, 0.7])
    for found, source in (
        (population.estimate_from_look(skin), SCENE),
        (population.estimate_from_white(skin, white), WHITE_POINT),
        (SkinTone.from_linear([0.312345, 0.2, 0.1], TEXTURE), TEXTURE),
    ):
        report = Reporter("solve")
        tone.tell_skin_tone(found, from_json({}), report)
        typed = ",".join(map(str, report.figures["skin_tone_srgb"]))
        assert found.source == source and read_given_tone(typed).linear == found.linear


@pytest.mark.parametrize(
    ("source", "options", "count"),
    [(SCENE, {}, 1), (TEXTURE, {}, 1), (EYES, {}, 1), (EARLIER, {}, 1), (WHITE_POINT, {"white_point": "1,1,1"}, 0)]
    + [(EARLIER, {"skin_tone": "0.5,0.4,0.3"}, 0)],
)
def test_a_tone_that_only_the_pictures_tell_is_said_to_be_a_guess(source, options, count):
    report, told = Reporter("solve"), {} if source == EARLIER else dict(deviation=6.0, error=5.0, group="tan")
    tone.tell_skin_tone(SkinTone.from_srgb([0.5, 0.4, 0.3], source, **told), from_json({"solve": options}), report)
    assert len(report.findings) == count


def test_a_prior_is_told_a_tone_and_stays_as_it_is():
    ours, coords = prior_files.load(dtype=torch.float32), prior.make_coordinates(1024, slice(480, 512), slice(480, 512))
    x = torch.randn(1, 7, 32, 32, generator=torch.Generator().manual_seed(0))
    before = dict(vars(ours))
    light, dark = (ours.of_tone(tone * torch.tensor([1.0, 0.7, 0.5])) for tone in (0.6, 0.1))
    first = light(x, 1.0, coords)
    assert not torch.equal(dark(x, 1.0, coords), first) and torch.equal(light(x, 1.0, coords), first)
    assert all(vars(ours)[name] is value for name, value in before.items()) and len(before) == len(vars(ours))


def test_the_artists_tone_wins_and_a_capture_without_frames_asks_its_texture(tmp_path):
    capture, report = make(tmp_path / "a.wildcap"), Reporter("solve")
    head = read_head(capture)
    evidence = tone.read_evidence(capture, head, 64)
    told = tone.resolve_skin_tone(capture, settings(skin_tone="0.5,0.4,0.3"), evidence, report)
    found = tone.resolve_skin_tone(capture, settings(skin_tone="auto"), evidence, report)
    assert found.source == TEXTURE and found.deviation >= 6
    assert told == replace(SkinTone.from_srgb([0.5, 0.4, 0.3], GIVEN), estimate=found), "which may be taken later"
    tone.run(capture, from_json({}), report)
    assert report.figures["skin_tone_source"] == "texture" and "skin_tone_estimate_srgb" not in report.figures


def test_a_swatch_is_given_in_the_hue_of_the_estimate(tmp_path):
    capture, report = make(tmp_path / "a.wildcap"), Reporter("solve")
    head = read_head(capture)
    evidence = tone.read_evidence(capture, head, 64)
    found = tone.resolve_skin_tone(capture, settings(skin_tone="auto"), evidence, report)
    told = tone.resolve_skin_tone(capture, settings(skin_tone="6"), evidence, report)
    person = tuple(map(float, found.srgb))
    assert told.srgb == pytest.approx(make_swatches(person)[5], abs=1e-4) and told.source == GIVEN
    tone.tell_skin_tone(told, settings(skin_tone="6"), report)
    assert report.figures["skin_tone_estimate_srgb"] == pytest.approx(person, abs=1e-4) and not report.findings
    assert report.figures["skin_tone_srgb"] == pytest.approx(told.srgb, abs=1e-4)
    assert report.figures["skin_tone_deviation_l"] == round(found.deviation, 1), "the panel marks the estimate by it"


def test_who_gives_a_colour_needs_no_skin_in_the_pictures(tmp_path, monkeypatch):
    capture, report = make(tmp_path / "a.wildcap"), Reporter("solve")
    head = read_head(capture)
    evidence = tone.read_evidence(capture, head, 64)

    def blind(*arguments):
        raise NoSkinError("No facial skin was seen.")

    monkeypatch.setattr(tone, "estimate_from_texture", blind)
    told = tone.resolve_skin_tone(capture, settings(skin_tone="0.5,0.4,0.3"), evidence, report)
    assert told == SkinTone.from_srgb([0.5, 0.4, 0.3], GIVEN)
    for setting in ("auto", "6"):
        with pytest.raises(NoSkinError):
            tone.resolve_skin_tone(capture, settings(skin_tone=setting), evidence, report)
