# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings: one place for defaults, ranges and tooltips; nothing out of range gets in."""

import json

import pytest

from core.settings.settings import (
    QUALITIES,
    STAGE_KINDS,
    Settings,
    find_setting,
    from_json,
    known_settings,
    preset,
    result_paths,
    to_json,
    tooltips,
)
from tests.fixtures.refused import refuses

PATHS = [name for name, field in known_settings().items() if "path" in field.metadata]


@pytest.mark.parametrize("name", PATHS)
def test_a_place_counts_where_the_result_depends_on_it(name, tmp_path):
    stage, own = name.split(".")
    settings = getattr(from_json({stage: {own: str(tmp_path / "mine")}}), stage)
    assert result_paths(settings) == ({} if name == "deliver.folder" else {own: str(tmp_path / "mine")})
    assert not result_paths(getattr(Settings(), stage))


def test_a_place_in_the_home_folder_is_found(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    assert result_paths(from_json({"solve": {"prior": "~/authors"}}).solve) == {"prior": str(tmp_path / "authors")}


def test_presets_differ_survive_json_and_standard_is_the_default():
    presets = [preset(quality) for quality in QUALITIES]
    assert [from_json(json.loads(json.dumps(to_json(each)))) for each in presets] == presets
    assert preset("standard") == Settings() and len(set(presets)) == len(QUALITIES)
    refuses("draft", preset, "superb")


@pytest.mark.parametrize("name", known_settings())
def test_every_setting_has_a_tooltip_a_valid_default_and_limits_that_hold(name):
    field, (stage, _, own) = find_setting(name), name.rpartition(".")
    tooltip = tooltips(STAGE_KINDS.get(stage, Settings)).get(own, "")
    assert tooltip and not tooltip.endswith(".") and "\n" not in tooltip

    def choose(value) -> Settings:
        return from_json({stage: {own: value}} if stage else {own: value})

    assert choose(field.default) == Settings()
    limits = field.metadata
    kinds = limits.keys() & {"path", "choices", "form", "min"}
    assert len(kinds) == (0 if isinstance(field.default, bool) else 1), "one of them, and a switch needs none"
    assert ("path" in limits) <= (field.default == ""), "a place is never chosen beforehand"
    wrong = [[1], *([limits["min"] - 1, limits["max"] + 1] if "min" in limits else [])]
    for value in [*wrong, *(["something else"] if "choices" in limits else [])]:
        refuses(own or stage, choose, value)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"moon": {}}, "moon"),
        ({"solve": {"moon": 1}}, "solve.moon"),
        ({"solve": {"steps": True}}, "solve.steps"),
        ({"solve": {"steps": "5"}}, "solve.steps"),
        ({"device": 0}, "device"),
        ({"__doc__": "x"}, "no setting"),
        ({"solve.steps": 5}, "no key 'solve.steps'"),
        ([1], "object"),
        ("seed", "object"),
        ({"solve": None}, "stage solve"),
        ({"scan": {"voxel_mm": float("nan")}}, "0.3 to 5 mm"),
        ({"scan": {"voxel_mm": float("inf")}}, "0.3 to 5 mm"),
        ({"scan": {"voxel_mm": 10**400}}, "0.3 to 5 mm"),
    ],
)
def test_what_is_no_setting_is_refused(values, words):
    refuses(words, from_json, values)


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("slove", "solve"),
        ("skin_tone", "solve.skin_tone"),
    ],
)
def test_the_nearest_setting_is_named(wrong, right):
    refuses(f"Did you mean {right}\\?", find_setting, wrong)


def test_a_whole_number_does_for_a_fraction():
    value = from_json({"scan": {"voxel_mm": 2}}).scan.voxel_mm
    assert value == 2.0 and isinstance(value, float)
