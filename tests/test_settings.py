# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings: one place for defaults, ranges and tooltips; nothing out of range gets in."""

import json
from dataclasses import fields

import pytest

from core.contract import stages
from core.contract.messages import Problem
from core.contract.settings import QUALITIES, Settings, from_json, preset, to_json, tooltips

EVERY = [(stage, field) for stage in stages.NAMES for field in fields(getattr(Settings(), stage))]


def test_every_stage_has_settings():
    assert all(hasattr(getattr(Settings(), stage), "__dataclass_fields__") for stage in stages.NAMES)


@pytest.mark.parametrize("quality", QUALITIES)
def test_presets_survive_json(quality):
    assert from_json(json.loads(json.dumps(to_json(preset(quality))))) == preset(quality)


def test_presets_differ_and_standard_is_the_default():
    assert preset("standard") == Settings() and len({str(preset(quality)) for quality in QUALITIES}) == len(QUALITIES)


def test_values_lie_over_the_base():
    settings = from_json({"seed": 3, "solve": {"steps": 5}}, preset("draft"))
    assert (settings.seed, settings.solve.steps, settings.solve.size) == (3, 5, preset("draft").solve.size)


@pytest.mark.parametrize(("stage", "field"), EVERY, ids=[f"{stage}.{field.name}" for stage, field in EVERY])
def test_every_setting_has_a_tooltip_a_valid_default_and_limits_that_hold(stage, field):
    tooltip = tooltips(type(getattr(Settings(), stage))).get(field.name, "")
    assert tooltip and not tooltip.endswith(".") and "\n" not in tooltip
    assert getattr(from_json({stage: {field.name: field.default}}), stage) == getattr(Settings(), stage)
    limits = field.metadata
    if isinstance(field.default, int | float) and not isinstance(field.default, bool):
        assert limits["min"] <= field.default <= limits["max"]
        for bad in (limits["min"] - 1, limits["max"] + 1):
            with pytest.raises(Problem, match="goes from"):
                from_json({stage: {field.name: bad}})
    if "choices" in limits:
        with pytest.raises(Problem, match="Choose one of"):
            from_json({stage: {field.name: "something else"}})
    with pytest.raises(Problem):
        from_json({stage: {field.name: [1]}})


@pytest.mark.parametrize("values", [{"moon": {}}, {"solve": {"moon": 1}}, {"solve": {"steps": True}}, {"solve": {"steps": "5"}}, {"seed": "5"}, {"device": 0}])
def test_what_is_no_setting_is_refused(values):
    with pytest.raises(Problem):
        from_json(values)


def test_an_unknown_quality_is_refused():
    with pytest.raises(Problem, match="draft"):
        preset("superb")
