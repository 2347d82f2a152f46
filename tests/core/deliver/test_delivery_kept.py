# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A delivery over an older one: files that others put there stay, files of ours that were changed are refused by name,
a kill loses nothing."""

import os
import shutil

import pytest

from core.capture import delivery_plan
from core.capture.capture import Capture
from core.capture.messages import Done, Failed, Problem
from core.settings.settings import DeliverSettings
from tests.fixtures import delivered
from tests.fixtures.delivered import OBJ, folder


@pytest.fixture
def capture(tmp_path) -> Capture:
    return delivered.make(tmp_path / "Zoë et moi.wildcap")


def test_files_that_others_added_stay_and_the_delivery_goes_on(capture):
    delivered.deliver(capture, **OBJ)
    place = folder(capture)
    (place / "my notes.txt").write_text("mine")
    (place / "textures" / "painted.psd").write_text("mine too")
    (place / "look").mkdir()
    (place / "look" / "shader.ma").write_text("and mine")
    first = (place / delivery_plan.PROVENANCE).stat().st_ino
    assert isinstance(delivered.deliver(capture, **{**OBJ, "hair": False}), Done)
    assert (place / "my notes.txt").read_text() == "mine"
    assert (place / "textures" / "painted.psd").read_text() == "mine too"
    assert (place / "look" / "shader.ma").read_text() == "and mine"
    assert (place / delivery_plan.PROVENANCE).stat().st_ino != first
    assert [path.name for path in capture.exports.iterdir()] == [place.name], "nothing is left beside it"


def test_a_delivery_goes_where_a_link_in_its_place_leads_and_the_link_stays(capture, tmp_path):
    delivered.deliver(capture, **OBJ)
    place, elsewhere = folder(capture), tmp_path / "another disk"
    shutil.move(place, elsewhere)
    (elsewhere / "my notes.txt").write_text("mine")
    place.symlink_to(elsewhere, target_is_directory=True)
    assert isinstance(delivered.deliver(capture, **{**OBJ, "hair": False}), Done)
    assert place.is_symlink() and (elsewhere / "my notes.txt").read_text() == "mine"
    assert delivery_plan.read_delivered(elsewhere)
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")], "nothing is left beside it"


def test_files_of_ours_that_were_changed_are_refused_by_name_and_given_up_when_asked(capture):
    delivered.deliver(capture, **OBJ)
    picture = next((folder(capture) / "textures").glob("*.png"))
    picture.write_bytes(b"graded by hand")
    ended = delivered.deliver(capture, **OBJ)
    assert isinstance(ended, Failed) and picture.name in ended.problem and "--replace" in ended.remedy
    assert picture.read_bytes() == b"graded by hand"
    assert isinstance(delivered.deliver(capture, **OBJ, replace=True), Done)
    assert picture.read_bytes() != b"graded by hand"


def test_a_file_of_others_under_a_name_of_the_new_delivery_is_refused_by_name(capture):
    delivered.deliver(capture, **{**OBJ, "pictures": "png16"})
    (folder(capture) / "textures" / "face_diffuse.exr").write_text("mine")
    plan = delivery_plan.plan(capture, DeliverSettings(format="obj", pictures="exr"))
    before = {path: path.read_bytes() for path in sorted(capture.exports.rglob("*.*")) if path.is_file()}
    (plan.staged / "textures").mkdir(parents=True)
    (plan.staged / "textures" / "face_diffuse.exr").write_text("ours")
    with pytest.raises(Problem, match="textures/face_diffuse.exr .*is in the way"):
        delivery_plan.put_in_place(plan)
    delivery_plan.discard(plan)
    assert {path: path.read_bytes() for path in sorted(capture.exports.rglob("*.*")) if path.is_file()} == before


def test_what_others_put_into_both_an_older_delivery_and_the_new_one_is_kept_twice(capture):
    """A kill left the older one aside; meanwhile somebody put a file of the same name into the new one."""
    delivered.deliver(capture, **OBJ)
    place = folder(capture)
    old = place.with_name(f".{place.name}.old")
    shutil.copytree(place, old)
    (old / "notes.txt").write_text("older")
    (place / "notes.txt").write_text("newer")
    assert isinstance(delivered.deliver(capture, **OBJ), Done)
    notes = {path.name: path.read_text() for path in place.glob("notes*")}
    assert notes == {"notes.txt": "newer", "notes_2.txt": "older"} and not old.exists()


@pytest.mark.parametrize("at", range(6))
def test_killed_at_any_rename_a_delivery_loses_nothing_of_others(capture, at, monkeypatch):
    delivered.deliver(capture, **OBJ)
    place = folder(capture)
    for name in ("a notes.txt", "b notes.txt"):
        (place / name).write_text(name)
    plan = delivery_plan.plan(capture, DeliverSettings(format="obj"))
    shutil.copytree(place, plan.staged, ignore=shutil.ignore_patterns("*notes.txt"))
    renames, rename = [], os.replace

    def counted(*places):
        renames.append(places)
        if len(renames) > at:
            raise KeyboardInterrupt  # nothing of ours catches it, as nothing catches a kill
        rename(*places)

    monkeypatch.setattr(delivery_plan.os, "replace", counted)
    try:
        delivery_plan.put_in_place(plan)
    except KeyboardInterrupt:
        pass
    monkeypatch.setattr(delivery_plan.os, "replace", rename)
    delivery_plan.discard(plan)
    assert isinstance(delivered.deliver(capture, **OBJ), Done), "the next delivery ends what was begun"
    notes = {path.name: path.read_text() for path in place.glob("* notes.txt")}
    assert notes == {name: name for name in ("a notes.txt", "b notes.txt")}
    assert [path.name for path in capture.exports.iterdir()] == [place.name]


def test_another_captures_delivery_is_refused_by_name_and_given_up_when_asked(tmp_path):
    """Names that no program takes in a file's name become alike."""
    ivan, maria = (delivered.make(tmp_path / f"{name}.wildcap") for name in ("Иван", "Мария"))
    to = str(tmp_path / "heads")
    assert isinstance(delivered.deliver(ivan, **OBJ, folder=to), Done)
    place = tmp_path / "heads" / "head_head_blender_obj"
    before = {path.name: path.read_bytes() for path in place.rglob("*") if path.is_file()}
    ended = delivered.deliver(maria, **OBJ, folder=to)
    assert isinstance(ended, Failed) and "Иван.wildcap" in ended.problem and "--replace" in ended.remedy
    assert {path.name: path.read_bytes() for path in place.rglob("*") if path.is_file()} == before
    assert isinstance(delivered.deliver(ivan, **OBJ, folder=to), Done), "its own is replaced as ever"
    assert isinstance(delivered.deliver(maria, **OBJ, folder=to, replace=True), Done)
