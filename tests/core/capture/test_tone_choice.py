# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's skin tone lives in the capture: every job uses it, no stage becomes stale by it, and a copy has it."""

import shutil

import numpy as np
import pytest

from core.capture import stages, tone_choice
from core.capture.capture import Capture
from core.capture.tone_choice import (
    asks_for_choice,
    find_change,
    read_choice,
    read_estimate,
    read_solved_tone,
    write_choice,
)
from core.capture.toned_albedo import apply_tone
from core.settings.colour_values import to_linear
from core.settings.settings import from_json
from core.settings.skin_swatches import make_swatches
from core.worker.job import last_settings, read_job, write_job
from tests.fixtures.recorded import make_entry
from tests.fixtures.refused import refused

SOLVED, ESTIMATE = [0.5, 0.4, 0.3], [0.6, 0.45, 0.35]


def solved(**figures) -> dict:
    """capture.json of a solve with these figures."""
    return {"stages": {"solve": make_entry(figures=figures)}}


@pytest.fixture
def capture(tmp_path) -> Capture:
    made = Capture(tmp_path / "a.wildcap")
    made.claim()
    return made


def test_a_job_uses_the_choice_and_a_job_with_a_tone_makes_it_the_choice(capture, tmp_path):
    assert read_job(write_job(capture)).settings.solve.skin_tone == "auto" and read_choice(capture) is None
    write_choice(capture, "6")
    assert read_job(write_job(capture)).settings.solve.skin_tone == "6"
    write_job(capture, settings={"solve": {"skin_tone": "#B08A76", "steps": 7}})
    assert read_choice(capture) == last_settings(capture).solve.skin_tone == "#B08A76"
    write_choice(capture, "0.6,0.5,0.4")
    assert last_settings(capture).solve.skin_tone == "0.6,0.5,0.4" and last_settings(capture).solve.steps == 7
    copy = Capture(shutil.copytree(capture.root, tmp_path / "copy.wildcap"))
    assert last_settings(copy) == last_settings(capture)
    write_job(capture, settings={"solve": {"skin_tone": "auto"}})
    assert read_choice(capture) == "auto" and read_job(write_job(capture)).settings.solve.skin_tone == "auto"


def test_what_is_no_tone_is_refused_and_changes_nothing(capture):
    write_choice(capture, "6")
    refused(lambda: write_choice(capture, "11"), "not a colour")
    refused(lambda: write_job(capture, settings={"solve": {"skin_tone": "pink"}}), "not a colour")
    assert read_choice(capture) == "6" and not capture.job.is_file()
    for damage in ("{", '{"skin_tone": 6}', '{"skin_tone": "pink"}', "[]"):
        capture.skin_tone.write_text(damage)
        refused(lambda: read_choice(capture), "cannot be used")


def test_a_tone_that_is_chosen_after_the_solve_leaves_it_as_it_is(capture):
    stage = stages.by_name("solve")
    for name in stage.writes:
        (capture.root / name).parent.mkdir(exist_ok=True)
        (capture.root / name).touch()
    auto = from_json({})
    capture.finish(stage, capture.conditions(stage, auto), 1.0, auto, {}, "0")
    assert capture.state(stage, from_json({"solve": {"skin_tone": "6"}})) == "done"
    assert capture.state(stage, from_json({"solve": {"steps": 7}})) == "stale"


@pytest.mark.parametrize(
    ("figures", "choice", "chosen"),
    [
        ({"skin_tone_srgb": SOLVED, "skin_tone_source": "scene"}, "auto", None),
        ({"skin_tone_srgb": SOLVED, "skin_tone_source": "scene"}, "0.5,0.4,0.3", None),
        ({"skin_tone_srgb": SOLVED, "skin_tone_source": "scene"}, "0.6,0.5,0.4", (0.6, 0.5, 0.4)),
        ({"skin_tone_srgb": SOLVED, "skin_tone_source": "scene"}, "3", tuple(make_swatches(tuple(SOLVED))[2])),
        (
            {"skin_tone_srgb": SOLVED, "skin_tone_source": "given", "skin_tone_estimate_srgb": ESTIMATE},
            "3",
            tuple(make_swatches(tuple(ESTIMATE))[2]),
        ),
        (
            {"skin_tone_srgb": SOLVED, "skin_tone_source": "given", "skin_tone_estimate_srgb": ESTIMATE},
            "auto",
            tuple(ESTIMATE),
        ),
        ({"skin_tone_srgb": SOLVED, "skin_tone_source": "given"}, "auto", None),
        ({"skin_tone_srgb": "0.5", "skin_tone_source": 3}, "3", None),
        ({}, "3", None),
    ],
)
def test_a_choice_is_a_colour_a_swatch_in_the_persons_hue_or_the_estimate(figures, choice, chosen):
    change = find_change(solved(**figures), choice)
    assert (change and change.chosen) == chosen
    assert change is None or change.solved == tuple(SOLVED)


def test_an_estimate_keeps_its_deviation():
    tone = read_solved_tone(solved(skin_tone_srgb=SOLVED, skin_tone_source="scene", skin_tone_deviation_l=8.5))
    assert tone.estimate == tone.solved == tuple(SOLVED) and tone.deviation == 8.5
    assert read_solved_tone({"stages": {}}) is None and read_estimate({"stages": {}}) is None


def test_an_earlier_stage_may_tell_the_estimate_and_the_solve_knows_better():
    early = make_entry(figures={"skin_tone_srgb": ESTIMATE, "skin_tone_source": "scene", "skin_tone_deviation_l": 12.0})
    stages_of = {"frames": early}
    told = read_estimate({"stages": stages_of})
    assert (told.estimate, told.deviation) == (tuple(ESTIMATE), 12.0)
    assert asks_for_choice({"stages": stages_of}, "auto") and not asks_for_choice({"stages": stages_of}, "6")
    stages_of["solve"] = make_entry(
        figures={"skin_tone_srgb": SOLVED, "skin_tone_source": "scene", "skin_tone_deviation_l": 6.0}
    )
    told = read_estimate({"stages": stages_of})
    assert (told.estimate, told.deviation) == (tuple(SOLVED), 6.0)
    assert not asks_for_choice({"stages": stages_of}, "auto")
    stages_of["solve"]["figures"]["skin_tone_source"] = "no colour"
    assert asks_for_choice({"stages": stages_of}, "auto"), "whatever its deviation is"


def test_skin_of_the_solved_tone_becomes_the_chosen_one_and_what_has_no_weight_stays():
    change = tone_choice.ToneChange((0.5, 0.4, 0.3), (0.7, 0.55, 0.45))
    linear = [to_linear(colour) for colour in (change.solved, change.chosen)]
    albedo = np.array([linear[0], linear[0], linear[0]])
    toned = apply_tone(albedo, np.array([[1.0], [0.0], [0.5]]), np.array(change.gain))
    assert np.allclose(toned, [linear[1], linear[0], np.mean(linear, 0)])
    assert apply_tone(np.full((1, 3), 0.9), 1.0, np.array(change.gain)).max() == 1
