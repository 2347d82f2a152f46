# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which maps a head wears is told by what was recorded of them: a copy of a capture has files of any times."""

import os
import shutil

import pytest

from core.capture import stages
from core.capture.capture import Capture
from core.capture.messages import Problem
from core.capture.newest_maps import WORN, find_newest_maps
from core.settings.settings import Settings, from_json
from tests.fixtures import standin
from tests.fixtures.recorded import record

UPSCALE = stages.by_name("upscale")


@pytest.fixture
def enlarged(tmp_path) -> Capture:
    """The stand-in's capture with maps at 4K whose record is that of the stage."""
    capture = Capture(standin.make(tmp_path / "Zoë et moi" / "head.wildcap"))
    shutil.copytree(capture.maps, capture.maps_4k)
    record(capture, UPSCALE, Settings())
    return capture


def date(folder, seconds: float) -> None:
    for path in folder.iterdir():
        os.utime(path, (seconds, seconds))


def is_at_4k(capture: Capture) -> bool:
    found = find_newest_maps(capture)
    assert [path.name for path in found] == list(WORN) and len({path.parent for path in found}) == 1
    return found[0].parent == capture.maps_4k


@pytest.mark.parametrize("solved, at_4k", [(1e9, 2e9), (2e9, 1e9), (2e9, 2e9)])
def test_maps_at_4k_that_were_made_of_the_solved_ones_are_worn_whatever_times_files_have(enlarged, solved, at_4k):
    date(enlarged.maps, solved), date(enlarged.maps_4k, at_4k)
    assert is_at_4k(enlarged)


@pytest.mark.parametrize("name", WORN)
def test_maps_of_a_later_solve_are_worn_whatever_times_files_have(enlarged, name):
    (enlarged.maps / name).write_bytes((enlarged.maps / name).read_bytes() + b" ")
    date(enlarged.maps, 1e9), date(enlarged.maps_4k, 2e9)
    assert not is_at_4k(enlarged)


@pytest.mark.parametrize(
    ("change", "at_4k"),
    [
        (lambda capture: (capture.maps_4k / "normal.png").unlink(), False),
        (lambda capture: shutil.rmtree(capture.maps), True),  # what is gone contradicts nothing
    ],
    ids=["an incomplete folder", "no solved maps"],
)
def test_an_incomplete_folder_is_not_worn(enlarged, change, at_4k):
    change(enlarged)
    assert is_at_4k(enlarged) == at_4k


def test_other_settings_of_the_enlarging_do_not_take_its_maps_away(enlarged):
    assert enlarged.state(UPSCALE, from_json({"upscale": {"size": 2048}})) == "stale"
    assert is_at_4k(enlarged)


def test_where_no_record_tells_the_times_do(enlarged):
    enlarged.forget(["upscale"])
    date(enlarged.maps, 1e9), date(enlarged.maps_4k, 2e9)
    assert is_at_4k(enlarged)
    date(enlarged.maps, 3e9)
    assert not is_at_4k(enlarged)


def test_a_capture_without_maps_names_the_solved_ones(tmp_path):
    found = find_newest_maps(Capture(tmp_path / "new.wildcap"))
    assert found == [tmp_path / "new.wildcap" / "maps" / name for name in WORN]


def test_a_damaged_record_is_named(enlarged):
    enlarged.json.write_text("{", encoding="utf-8")
    with pytest.raises(Problem, match="cannot be read"):
        find_newest_maps(enlarged)


def test_a_copied_capture_wears_its_maps_at_4k_in_blender(addon, enlarged):
    bpy = pytest.importorskip("bpy")
    date(enlarged.maps, 3e9), date(enlarged.maps_4k, 2e9)
    bpy.ops.wildcap.open_capture(directory=str(enlarged.root))
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    head = addon("captures").head(bpy.context, addon("captures").active(bpy.context))

    def shown() -> set[str]:
        nodes = head.data.materials[0].node_tree.nodes
        return {
            bpy.path.native_pathsep(nodes[name].image.filepath).split(os.sep)[-2]
            for name in ("WildCap Albedo", "WildCap Specular", "WildCap Normal")
        }

    assert shown() == {"maps_4k"}
    addon("status")._known.clear()
    addon("status").refresh(bpy.context)
    known = addon("status").of(addon("captures").active(bpy.context))
    assert known.has_maps and known.maps_time == 2e9 == head["wildcap_maps_time"]
    (enlarged.maps / "normal.png").write_bytes((enlarged.maps / "normal.png").read_bytes() + b" ")
    bpy.ops.wildcap.assemble_material()
    assert shown() == {"maps"}, "of a later solve"
