# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A delivery over an older one: files that others put there stay, files of ours that were changed are refused by name,
a kill loses nothing."""

import os
import shutil
from pathlib import Path

import pytest

from core.capture import delivery_plan, provenance
from core.capture.capture import Capture
from core.capture.delivery_plan import DeliveryPlan
from core.capture.files import write_json
from core.capture.messages import Problem
from core.settings.settings import DeliverSettings
from tests.fixtures.kept_capture import contents
from tests.fixtures.refused import refuses

FILES = {"head.obj": "mesh", "textures/albedo.png": "albedo"}


def stage(root: Path, files: dict[str, str], **settings) -> DeliveryPlan:
    """A delivery of a capture, whole and not yet in place."""
    plan = delivery_plan.plan(Capture(root), DeliverSettings(format="obj", **settings))
    for name, text in files.items():
        (plan.staged / name).parent.mkdir(parents=True, exist_ok=True)
        (plan.staged / name).write_text(text)
    told = {"made_by": delivery_plan.MADE_BY, "versions": {}, "capture": {"name": root.name}}
    write_json(plan.staged / delivery_plan.PROVENANCE, told)
    provenance.finish(plan.staged)
    return plan


def deliver(root: Path, files: dict[str, str] = FILES, **settings) -> Path:
    plan = stage(root, files, **settings)
    delivery_plan.put_in_place(plan)
    return plan.target


def delivered(place: Path) -> dict[str, str]:
    files = {name: content.decode() for name, content in contents(place).items()}
    return {name: text for name, text in files.items() if name != delivery_plan.PROVENANCE}


@pytest.fixture
def root(tmp_path) -> Path:
    return tmp_path / "Zoë et moi.wildcap"


def test_files_that_others_added_stay_and_the_delivery_goes_on(root):
    place = deliver(root, {**FILES, "textures/brows.png": "brows"})
    mine = {"my notes.txt": "mine", "textures/painted.psd": "mine too", "look/shader.ma": "and mine"}
    for name, text in mine.items():
        (place / name).parent.mkdir(exist_ok=True)
        (place / name).write_text(text)
    new = {**FILES, "head.obj": "new mesh"}
    assert deliver(root, new) == place and delivered(place) == {**new, **mine}
    assert list(place.parent.iterdir()) == [place], "nothing is left beside it"


def test_a_delivery_goes_where_a_link_in_its_place_leads_and_the_link_stays(root, tmp_path):
    place, elsewhere = deliver(root), tmp_path / "another disk"
    shutil.move(place, elsewhere)
    (elsewhere / "my notes.txt").write_text("mine")
    place.symlink_to(elsewhere, target_is_directory=True)
    assert deliver(root, {"head.obj": "new mesh"}) == elsewhere and place.is_symlink()
    assert delivered(elsewhere) == {"head.obj": "new mesh", "my notes.txt": "mine"}
    assert not list(tmp_path.glob(".*")), "nothing is left beside it"


def test_files_of_ours_that_were_changed_are_refused_by_name_and_replaced_on_demand(root):
    place = deliver(root)
    (place / "textures" / "albedo.png").write_text("graded by hand")
    with pytest.raises(Problem, match="albedo.png") as problem:
        deliver(root)
    assert "--replace" in problem.value.remedy and delivered(place)["textures/albedo.png"] == "graded by hand"
    deliver(root, replace=True)
    assert delivered(place) == FILES


def test_a_file_of_others_under_a_name_of_the_new_delivery_is_refused_by_name(root):
    place = deliver(root)
    (place / "textures" / "face.exr").write_text("mine")
    before, plan = contents(place), stage(root, {"textures/face.exr": "ours"})
    refuses("textures/face.exr", delivery_plan.put_in_place, plan)
    delivery_plan.discard(plan)
    assert contents(place) == before and list(place.parent.iterdir()) == [place]


def test_a_folder_that_no_delivery_made_is_refused(root):
    plan = stage(root, FILES)
    plan.target.mkdir(parents=True)
    delivery_plan.check_target(plan)
    (plan.target / "my notes.txt").write_text("mine")
    refuses("WildCap did not deliver", delivery_plan.put_in_place, plan)
    assert delivered(plan.target) == {"my notes.txt": "mine"}


def test_what_others_put_into_both_an_older_delivery_and_the_new_one_is_kept_twice(root):
    """A kill left the older one aside; meanwhile somebody put a file of the same name into the new one."""
    place = deliver(root)
    old = place.with_name(f".{place.name}.old")
    shutil.copytree(place, old)
    (old / "notes.txt").write_text("older")
    (place / "notes.txt").write_text("newer")
    deliver(root)
    assert delivered(place) == {**FILES, "notes.txt": "newer", "notes_2.txt": "older"} and not old.exists()


@pytest.mark.parametrize("at", range(6))
def test_killed_at_any_rename_a_delivery_loses_nothing_of_others(root, at, monkeypatch):
    notes = {"a notes.txt": "a", "b notes.txt": "b"}
    place = deliver(root)
    for name, text in notes.items():
        (place / name).write_text(text)
    plan, left, rename = stage(root, FILES), iter(range(at)), os.replace

    def count_down(*places):
        if next(left, None) is None:
            raise KeyboardInterrupt  # nothing of ours catches it, as nothing catches a kill
        rename(*places)

    with monkeypatch.context() as patched:
        patched.setattr(delivery_plan.os, "replace", count_down)
        try:
            delivery_plan.put_in_place(plan)
        except KeyboardInterrupt:
            pass
    delivery_plan.discard(plan)
    deliver(root)
    assert delivered(place) == {**FILES, **notes} and list(place.parent.iterdir()) == [place]


def test_another_captures_delivery_is_refused_by_name_and_replaced_on_demand(tmp_path):
    """Names that no program takes in a file's name become alike."""
    to, ivan, maria = str(tmp_path / "heads"), tmp_path / "Иван.wildcap", tmp_path / "Мария.wildcap"
    place = deliver(ivan, folder=to)
    before = contents(place)
    with pytest.raises(Problem, match="Иван.wildcap") as problem:
        deliver(maria, folder=to)
    assert "--replace" in problem.value.remedy and contents(place) == before
    deliver(ivan, folder=to)
    assert deliver(maria, folder=to, replace=True) == place


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"format": "glb", "pictures": "exr"}, "EXR"),
        ({"format": "glb", "colour": "linear"}, "sRGB"),
        ({"pictures": "exr", "colour": "srgb", "format": "obj"}, "linear"),
        ({"pictures": "png8", "colour": "linear", "format": "obj"}, "8 bit"),
    ],
)
def test_choices_that_do_not_go_together_are_refused(root, settings, words):
    refuses(words, delivery_plan.plan, Capture(root), DeliverSettings(**settings))


@pytest.mark.parametrize(("what", "words"), [("head", "no head"), ("scan", "no scan"), ("own_mesh", "no fitted mesh")])
def test_a_mesh_that_is_missing_is_named(root, what, words):
    refuses(words, delivery_plan.needs, Capture(root), what)


def test_file_names_are_plain():
    assert delivery_plan.safe_name("山田") == "head" and delivery_plan.safe_name("Zoë & moi") == "Zoe_moi"
