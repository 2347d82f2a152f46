# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on in the bpy wheel: registration, settings, the list of captures, the head, problems. The real window is
tests/gui/."""

import json
import math
from pathlib import Path

import pytest

from core.capture.capture import Capture
from core.capture.messages import Problem
from tests.fixtures.drawn import draw, drawn
from tests.fixtures.recorded import make_entry
from tests.fixtures.refused import refuses

bpy = pytest.importorskip("bpy")


def registered() -> set[str]:
    kinds = {name for name in dir(bpy.types) if name.startswith("WILDCAP")}
    return kinds | ({"Scene.wildcap"} if hasattr(bpy.types.Scene, "wildcap") else set())


def handlers() -> list:
    lists = [
        value for value in map(bpy.app.handlers.__getattribute__, dir(bpy.app.handlers)) if isinstance(value, list)
    ]
    return [f for each in lists for f in each if getattr(f, "__module__", "").startswith("bl_ext.user_default.wildcap")]


def test_disabling_leaves_nothing_and_enabling_again_works(wildcap):
    import addon_utils

    before = registered()
    assert {"WILDCAP_PT_main", "WILDCAP_OT_solve", "Scene.wildcap"} <= before and handlers()
    addon_utils.disable(wildcap, default_set=True)
    assert registered() == set() and not handlers()
    addon_utils.enable(wildcap, default_set=True)
    assert registered() == before


def test_the_properties_are_those_of_the_settings(addon):
    properties = addon("properties")
    settings = properties.core_settings
    item = bpy.context.scene.wildcap.captures.add()
    assert properties.settings(item) == settings.Settings()
    for stage, kind in properties.STAGE_KINDS.items():
        for name, f in kind.__dataclass_fields__.items():
            rna = getattr(item, stage).bl_rna.properties[name]
            assert rna.description == settings.tooltips(kind)[name]
            if "choices" in f.metadata:
                assert tuple(e.identifier for e in rna.enum_items) == f.metadata["choices"]
                continue
            for key, bound in (("min", "hard_min"), ("max", "hard_max")):
                if key in f.metadata:
                    assert getattr(rna, bound) == pytest.approx(f.metadata[key])


def test_a_quality_sets_the_settings_and_keeps_the_skin_tone(addon):
    properties = addon("properties")
    item = bpy.context.scene.wildcap.captures.add()
    item.use_skin_tone, item.skin_tone = True, (0.5, 0.25, 0.125)
    item.solve.prior = "/authors"
    item.quality = "draft"
    solve, draft = properties.job_settings(item)["solve"], properties.core_settings.preset("draft").solve
    assert solve["prior"] == str(Path("/authors").absolute()) and solve["skin_tone"] == "0.5000,0.2500,0.1250"
    assert (solve["size"], solve["steps"]) == (draft.size, draft.steps)


# from Blender 4.5 on it warns; what was typed in an older one stays in the file
@pytest.mark.filterwarnings("ignore:.*does not support blend relative")
def test_every_place_on_the_disk_is_chosen_as_one_and_made_absolute(addon, tmp_path):
    properties = addon("properties")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "faces.blend"))
    item = bpy.context.scene.wildcap.captures.add()
    fields = properties.core_settings.known_settings()
    places = {name: field.metadata["path"] for name, field in fields.items() if "path" in field.metadata}
    assert len(places) >= 8
    written = {
        "//mine é/": tmp_path / "mine é",
        "mine": Path("mine").absolute(),
        "~/mine": Path("~/mine").expanduser(),
        "": "",
    }
    for name, kind in places.items():
        stage, own = name.split(".")
        group = getattr(item, stage)
        assert group.bl_rna.properties[own].subtype == ('DIR_PATH' if kind == "folder" else 'FILE_PATH'), name
        for path, absolute in written.items():
            setattr(group, own, path)
            assert properties.job_settings(item)[stage][own] == str(absolute), name


def test_a_video_finds_its_capture_again_and_another_of_the_same_name_gets_its_own(addon, tmp_path):
    addon("preferences").get().captures = str(tmp_path / "captures")
    videos = [tmp_path / folder / "Mon visage é.mp4" for folder in ("a", "b")]
    for video in videos:
        video.parent.mkdir()
        video.write_bytes(b"0")
    for video in (videos[0], *videos):
        bpy.ops.wildcap.choose_video(filepath=str(video))
    roots = [tmp_path / "captures" / f"{name}.wildcap" for name in ("Mon visage é", "Mon visage é_2")]
    assert [Path(item.path) for item in bpy.context.scene.wildcap.captures] == roots
    assert [Capture(root).source for root in roots] == videos


def test_an_error_is_shown_as_a_problem_with_a_remedy(addon, capture, monkeypatch):
    monkeypatch.setattr(addon("head"), "bring_in", lambda *_: 1 / 0)
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        bpy.ops.wildcap.bring_in_head()
    problem = addon("problems").of(str(capture))
    assert "An error inside WildCap stopped" in problem.problem and problem.remedy


def test_the_head_comes_in_upright_with_its_uvs_and_again_in_place(capture, head):
    assert head["wildcap_capture"] == str(capture)
    assert tuple(head.dimensions) == pytest.approx((0.16, 0.1 - 0.1 * math.cos(0.8 * math.pi), 0.24), abs=2e-3)
    assert head.bound_box[0][1] == pytest.approx(-0.1, abs=1e-4)  # the face, towards -Y
    assert [layer.name for layer in head.data.uv_layers] == ["UVMap"]
    head.location.x = 1.0
    bpy.ops.wildcap.bring_in_head()
    assert [o.name for o in bpy.context.scene.objects] == [head.name] and head.location.x == 1.0


def test_the_sample_head_opens_relightable_and_the_artists_copy_of_it_as_it_is(addon, tmp_path):
    addon("preferences").get().captures = str(tmp_path / "captures")
    bpy.ops.wildcap.open_sample_head()
    head = bpy.context.view_layer.objects.active
    capture = tmp_path / "captures" / "sample_head.wildcap"
    assert "WildCap Skin" in head.data.materials[0].node_tree.nodes and head["wildcap_capture"] == str(capture)
    (capture / "maps" / "normal.png").unlink()  # on its way to other maps
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wildcap.open_sample_head()
    assert bpy.context.view_layer.objects.active["wildcap_capture"] == str(capture)


def test_what_is_wrong_with_a_video_stands_in_the_tab(addon, capture):
    doctor, status = addon("panel").WILDCAP_PT_doctor, addon("status")
    status.refresh(bpy.context)
    assert not doctor.poll(bpy.context)
    Capture(capture).stop("cameras", Problem("Nothing was seen from the left.", "Film from ear to ear."))
    status.refresh(bpy.context)
    assert doctor.poll(bpy.context)
    texts = [text for text, _ in drawn(doctor)]
    assert "Nothing was seen from the left." in texts and "Film from ear to ear." in texts
    refuses("no report yet", bpy.ops.wildcap.open_report)


def test_a_row_has_a_button_for_what_is_done_and_for_the_first_stage_that_is_to_do(addon, capture, monkeypatch):
    status = addon("status")
    (capture.parent / "face.mp4").write_bytes(b"0")
    Capture(capture).set_source(capture.parent / "face.mp4")
    monkeypatch.setattr(status.Capture, "verdict", lambda *_: status.freshness.Verdict("stale"))
    record = Capture(capture).read()
    record["stages"]["scan"] = make_entry(seconds=12.0)
    (capture / "capture.json").write_text(json.dumps(record), encoding="utf-8")
    status._known.clear()
    status.refresh(bpy.context)
    calls = draw(addon("panel").WILDCAP_PT_stages).calls
    assert [options["icon"] for name, _, options in calls if name == "operator"] == ['PLAY', 'FILE_REFRESH']
