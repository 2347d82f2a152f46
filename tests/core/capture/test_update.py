# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What an update of WildCap makes of a capture that 0.2.0 finished, by its record (capture_0_2_0.json): every stage is
made by older code, and none is out of date until an input or a setting changes."""

import json
from dataclasses import asdict, make_dataclass, replace

import pytest

from core.capture import stages
from core.capture.capture import Capture
from core.capture.files import write_json
from core.capture.freshness import SOURCE
from core.capture.hashes import hash_source
from core.settings.setting_values import setting
from core.settings.settings import Settings, from_json
from tests.conftest import ROOT

RECORD = json.loads((ROOT / "tests" / "fixtures" / "capture_0_2_0.json").read_text(encoding="utf-8"))
FINISHED = [stages.by_name(name) for name in RECORD["stages"]]
TEMPLATE = "registration.template"


@pytest.fixture
def finished(tmp_path) -> Capture:
    """A capture with that record, beside its film and the artist's own head; its files hold their own names."""
    (tmp_path / "film.mp4").write_bytes(b"a film")
    (tmp_path / "my head.obj").write_bytes(b"a head")
    capture = Capture(tmp_path / "face.wildcap")
    named = {name for entry in RECORD["stages"].values() for name, told in entry["inputs"].items() if told}
    for name in {*named, *(name for stage in FINISHED for name in stage.writes)} - {SOURCE, TEMPLATE}:
        path = capture.root / name / "one" if name.endswith("/") else capture.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(name.encode())
    write_json(capture.json, RECORD)
    return capture


def made_with(capture: Capture, **changed) -> Settings:
    """The settings that it was made with, with others laid over them."""
    chosen = from_json(
        {
            "seed": 3,
            "frames": {"mirrored": True},
            "cameras": {"interpupillary_mm": 61.0},
            "registration": {"template": str(capture.root.parent / "my head.obj")},
            "solve": {"skin_tone": "0.69,0.54,0.46"},
        }
    )
    return from_json(changed, chosen)


def stale(capture: Capture, settings: Settings) -> dict[str, tuple[str, ...]]:
    """Stage -> what changed, of those that are out of date; every other one has to be made by older code."""
    verdicts = {stage.name: capture.verdict(stage, settings) for stage in FINISHED}
    assert {verdict.state for verdict in verdicts.values()} <= {"older", "stale"}
    return {name: verdict.changed for name, verdict in verdicts.items() if verdict.state == "stale"}


def test_what_an_older_version_finished_is_made_by_older_code_and_not_out_of_date(finished):
    settings = made_with(finished)
    assert len(FINISHED) == 10 and stale(finished, settings) == {}
    for stage in FINISHED:
        inputs = RECORD["stages"][stage.name]["inputs"].keys() - {SOURCE, TEMPLATE}
        assert inputs == {*stage.reads, *stage.optional_reads} - {*stages.RETOUCHED}, stage.name
    assert {finished.verdict(stage, settings).reason() for stage in FINISHED} == {"made by older code (WildCap 0.2.0)"}
    film = finished.root.parent / "film.mp4"
    assert finished.made_from(film) and RECORD["source_stamp"] == hash_source(finished.source)
    finished.set_source(film)
    assert finished.read() == RECORD, "as it was written"


@pytest.mark.parametrize("stage", FINISHED, ids=lambda stage: stage.name)
def test_a_setting_that_a_stage_has_got_since_makes_nothing_stale(finished, stage):
    before = made_with(finished)
    own = getattr(before, stage.name)
    kind = make_dataclass("Later", [("smoothing", int, setting(3))], bases=(type(own),), frozen=True)
    assert stale(finished, replace(before, **{stage.name: kind(**asdict(own))})) == {}
    chosen = replace(before, **{stage.name: kind(**asdict(own), smoothing=4)})
    assert stale(finished, chosen) == {stage.name: (f"{stage.name}.smoothing",)}


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"frames": {"mirrored": False}}, {"frames": ("frames.mirrored",)}),
        ({"registration": {"template": ""}}, {"registration": (TEMPLATE,)}),
        ({"seed": 4}, dict.fromkeys((stage.name for stage in FINISHED if "seed" in stage.shared), ("seed",))),
        ({"solve": {"low_memory": True, "checkpoint_every": 9}}, {}),
    ],
    ids=str,
)
def test_a_setting_that_changed_is_told(finished, changed, told):
    assert stale(finished, made_with(finished, **changed)) == told
