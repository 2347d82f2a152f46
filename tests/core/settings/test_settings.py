# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings: one place for defaults, ranges and tooltips; nothing out of range gets in."""

import json
from dataclasses import fields

import pytest

from core.capture import stages
from core.capture.capture import Capture
from core.capture.messages import Problem
from core.settings.settings import (
    QUALITIES,
    STAGE_KINDS,
    Settings,
    find_setting,
    from_json,
    known_settings,
    preset,
    quality_settings,
    result_paths,
    result_settings,
    to_json,
    tooltips,
)
from tests.fixtures.recorded import changed, record

EVERY = [(stage, field) for stage, kind in STAGE_KINDS.items() for field in fields(kind)]
PATHS = [name for name, field in known_settings().items() if "path" in field.metadata]
METADATA = {
    "min",
    "max",
    "unit",
    "choices",
    "titles",
    "path",
    "when",
    "required",
    "holds",
    "form",
    "parse",
    "label",
    "flag",
    "per_face",
    "affects_result",
}


def test_every_stage_has_settings():
    assert list(STAGE_KINDS) == [*stages.NAMES, "deliver"]
    assert [name for name in known_settings() if "." not in name] == ["seed", "device", "edited_part"]
    assert all(tooltips(Settings)[name] for name in ("seed", "device", "edited_part"))


@pytest.mark.parametrize("name", known_settings())
def test_metadata_says_what_a_setting_may_be(name):
    field = known_settings()[name]
    assert field.metadata.keys() <= METADATA
    kinds = field.metadata.keys() & {"path", "choices", "form", "min"}
    assert len(kinds) == (0 if isinstance(field.default, bool) else 1), "one of them, and a switch needs none"
    assert field.metadata.get("path") in (None, "file", "folder", "file_or_folder")
    assert ("path" in field.metadata) <= (field.default == ""), "a place is never chosen beforehand"


def test_no_two_settings_of_a_command_have_one_flag():
    flags = [
        (name.startswith("deliver."), field.metadata["flag"])
        for name, field in known_settings().items()
        if "flag" in field.metadata
    ]
    assert len(flags) > 20 and len(set(flags)) == len(flags) and all(flag.startswith("--") for _, flag in flags)


@pytest.mark.parametrize("name", PATHS)
def test_the_content_of_a_place_counts_where_the_result_depends_on_it(name, tmp_path):
    stage, own = name.split(".")
    settings = from_json({stage: {own: str(tmp_path / "mine")}})
    if own not in result_settings(getattr(settings, stage)):
        assert name == "deliver.folder" and not result_paths(settings.deliver)
        return
    assert result_paths(getattr(settings, stage)) == {own: str(tmp_path / "mine")}
    assert not result_paths(getattr(Settings(), stage))
    capture, step = Capture(tmp_path / "a.wildcap"), stages.by_name(stage)
    record(capture, step, Settings())
    assert changed(capture, step, settings) == (name,), "named since"
    for content in ("one", "two two"):
        (tmp_path / "mine").write_text(content)
        assert changed(capture, step, settings) == (name,)
        record(capture, step, settings)
        assert changed(capture, step, settings) == ()
    assert changed(capture, step, Settings()) == (name,), "emptied since"


def test_a_place_in_the_home_folder_is_found(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    assert result_paths(from_json({"solve": {"prior": "~/authors"}}).solve) == {"prior": str(tmp_path / "authors")}


def test_a_quality_leaves_alone_what_is_about_the_face():
    left = {f"{stage}.{field.name}" for stage, field in EVERY if field.name not in quality_settings(STAGE_KINDS[stage])}
    assert left == {
        *PATHS,
        "frames.mirrored",
        "frames.no_glasses",
        "cameras.interpupillary_mm",
        "registration.new_atlas",
        "delight.delighter",
        "delight.switchlight_preview",
        "solve.skin_tone",
        "solve.white_point",
    }


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


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"moon": {}}, "no setting named 'moon'"),
        ({"solve": {"moon": 1}}, "no setting named 'solve.moon'"),
        ({"solve": {"steps": True}}, "True, which is not a int"),
        ({"solve": {"steps": "5"}}, "'5', which is not a int"),
        ({"seed": "5"}, "not a int"),
        ({"seed": -1}, "0 to 2147483647"),
        ({"device": 0}, "not a str"),
        ({"device": "abacus"}, "auto, cpu, cuda, mps"),
        ({"__doc__": "x"}, "no setting"),
        ({"solve.steps": 5}, "no key 'solve.steps'"),
        ([1], "object, not \\[1\\]"),
        ("seed", "object, not 'seed'"),
        ({"solve": 5}, "settings of the stage solve have to be an object, not 5"),
        ({"solve": None}, "object, not None"),
        ({"scan": {"voxel_mm": float("nan")}}, "0.3 to 5 mm"),
        ({"scan": {"voxel_mm": float("inf")}}, "0.3 to 5 mm"),
        ({"scan": {"voxel_mm": 10**400}}, "0.3 to 5 mm"),
    ],
)
def test_what_is_no_setting_is_refused(values, words):
    with pytest.raises(Problem, match=words) as refusal:
        from_json(values)
    assert refusal.value.remedy.endswith(".")


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("slove", "solve"),
        ("solve.step", "solve.steps"),
        ("slove.steps", "solve.steps"),
        ("skin_tone", "solve.skin_tone"),
        ("sede", "seed"),
        ("delight.delight", "delight.delighter"),
    ],
)
def test_the_nearest_setting_is_named(wrong, right):
    with pytest.raises(Problem, match=f"Did you mean {right}\\?"):
        find_setting(wrong)


def test_a_whole_number_does_for_a_fraction():
    value = from_json({"scan": {"voxel_mm": 2}}).scan.voxel_mm
    assert value == 2.0 and isinstance(value, float)


def test_an_unknown_quality_is_refused():
    with pytest.raises(Problem, match="draft"):
        preset("superb")
