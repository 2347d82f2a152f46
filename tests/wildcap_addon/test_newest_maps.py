# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which maps a head wears is told by what was recorded of them: a copy of a capture has files of any times."""

import os
import shutil

import pytest

from core.capture import stages
from core.capture.capture import Capture
from core.capture.newest_maps import WORN, find_newest_maps
from core.settings.settings import Settings, from_json
from tests.fixtures import standin
from tests.fixtures.recorded import record
from tests.fixtures.refused import refused

UPSCALE = stages.by_name("upscale")


@pytest.fixture
def enlarged(tmp_path, monkeypatch) -> Capture:
    """The stand-in's capture with maps at 4K whose record is that of the stage."""
    monkeypatch.setattr("core.capture.freshness.code_key", lambda module: "")
    capture = Capture(standin.make(tmp_path / "Zoë et moi" / "head.wildcap"))
    shutil.copytree(capture.maps, capture.maps_4k)
    record(capture, UPSCALE, Settings())
    return capture


def date(capture: Capture, maps: float, maps_4k: float) -> None:
    for folder, seconds in ((capture.maps, maps), (capture.maps_4k, maps_4k)):
        for path in folder.iterdir():
            os.utime(path, (seconds, seconds))


def change(path) -> None:
    path.write_bytes(path.read_bytes() + b" ")


def is_at_4k(capture: Capture) -> bool:
    maps = find_newest_maps(capture)
    assert [path.name for path in maps] == list(WORN) and len({path.parent for path in maps}) == 1
    return maps[0].parent == capture.maps_4k


@pytest.mark.parametrize("name", WORN)
def test_the_record_tells_which_maps_are_worn_whatever_times_files_and_later_settings_have(enlarged, name):
    assert enlarged.state(UPSCALE, from_json({"upscale": {"size": 2048}})) == "stale"
    for times in ((1e9, 2e9), (2e9, 1e9), (2e9, 2e9)):
        date(enlarged, *times)
        assert is_at_4k(enlarged)
    change(enlarged.maps / name)  # of a later solve
    date(enlarged, 1e9, 2e9)
    assert not is_at_4k(enlarged)


@pytest.mark.parametrize(
    ("lose", "at_4k"),
    [
        (lambda capture: (capture.maps_4k / "normal.png").unlink(), False),
        (lambda capture: shutil.rmtree(capture.maps), True),  # what is gone contradicts nothing
    ],
    ids=["an incomplete folder", "no solved maps"],
)
def test_a_folder_that_is_not_whole(enlarged, lose, at_4k):
    lose(enlarged)
    assert is_at_4k(enlarged) == at_4k


def test_where_no_record_tells_the_times_do(enlarged):
    enlarged.forget(["upscale"])
    for times, at_4k in (((1e9, 2e9), True), ((3e9, 2e9), False)):
        date(enlarged, *times)
        assert is_at_4k(enlarged) == at_4k


def test_a_capture_without_maps_names_the_solved_ones_and_one_with_a_damaged_record_is_refused(enlarged, tmp_path):
    new = Capture(tmp_path / "new.wildcap")
    assert find_newest_maps(new) == [new.maps / name for name in WORN]
    enlarged.json.write_text("{", encoding="utf-8")
    refused(lambda: find_newest_maps(enlarged), "cannot be read")


def test_a_copied_capture_wears_its_maps_at_4k_in_blender(addon, enlarged):
    bpy = pytest.importorskip("bpy")
    date(enlarged, 3e9, 2e9)
    bpy.ops.wildcap.open_capture(directory=str(enlarged.root))
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    item = addon("captures").active(bpy.context)
    head = addon("captures").head(bpy.context, item)

    def shown() -> set[str]:
        images = [node.image for node in head.data.materials[0].node_tree.nodes if getattr(node, "image", None)]
        return {bpy.path.native_pathsep(image.filepath).split(os.sep)[-2] for image in images}

    assert shown() == {"maps_4k"}
    addon("status")._known.clear()
    addon("status").refresh(bpy.context)
    known = addon("status").of(item)
    assert known.has_maps and known.maps_time == 2e9 == head["wildcap_maps_time"]
    change(enlarged.maps / "normal.png")
    bpy.ops.wildcap.assemble_material()
    assert shown() == {"maps"}, "of a later solve"
