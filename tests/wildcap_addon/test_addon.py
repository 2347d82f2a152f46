# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on in the bpy wheel: registering, settings, captures, head, problems, panels. The real window is
tests/gui/."""

import json
import math
import time
from pathlib import Path

import pytest

from core.capture.capture import Capture
from tests.fixtures import standin
from tests.fixtures.recorded import make_entry

bpy = pytest.importorskip("bpy")


def registered() -> set[str]:
    names = {
        name
        for kind in (
            bpy.types.Operator,
            bpy.types.Panel,
            bpy.types.UIList,
            bpy.types.PropertyGroup,
            bpy.types.AddonPreferences,
        )
        for name in (c.__name__ for c in kind.__subclasses__())
        if name.startswith("WILDCAP")
    }
    kinds = {name for name in names if hasattr(bpy.types, name)}
    return kinds | ({"Scene.wildcap"} if hasattr(bpy.types.Scene, "wildcap") else set())


def handlers() -> int:
    return sum(
        getattr(f, "__module__", "").startswith("bl_ext.user_default.wildcap")
        for name in dir(bpy.app.handlers)
        for f in (getattr(bpy.app.handlers, name) if isinstance(getattr(bpy.app.handlers, name), list) else ())
    )


def test_disabling_leaves_nothing_and_enabling_again_works(wildcap):
    import addon_utils

    before = registered()
    assert {"WILDCAP_PT_main", "WILDCAP_OT_solve", "Scene.wildcap"} <= before
    assert handlers() > 0
    addon_utils.disable(wildcap, default_set=True)
    assert registered() == set()
    assert handlers() == 0
    addon_utils.enable(wildcap, default_set=True)
    assert registered() == before


def test_the_properties_are_those_of_the_settings(addon):
    properties = addon("properties")
    settings = properties.core_settings
    bpy.context.scene.wildcap.captures.add()
    item = bpy.context.scene.wildcap.captures[0]
    assert properties.settings(item) == settings.Settings()
    for stage, kind in properties.STAGE_KINDS.items():
        group = getattr(item, stage)
        for name, f in kind.__dataclass_fields__.items():
            rna = group.bl_rna.properties[name]
            assert rna.description == settings.tooltips(kind)[name]
            for key, bound in (("min", "hard_min"), ("max", "hard_max")):
                if key in f.metadata and "choices" not in f.metadata:
                    assert getattr(rna, bound) == pytest.approx(f.metadata[key])
            if "choices" in f.metadata:
                assert tuple(e.identifier for e in rna.enum_items) == f.metadata["choices"]


def test_a_quality_sets_the_settings_and_keeps_the_skin_tone(addon):
    properties = addon("properties")
    item = bpy.context.scene.wildcap.captures.add()
    item.use_skin_tone, item.skin_tone = True, (0.5, 0.25, 0.125)
    item.solve.prior = "/authors"
    item.quality = "draft"
    values = properties.job_settings(item)
    assert values["solve"]["prior"] == str(Path("/authors").absolute())
    draft = properties.core_settings.preset("draft")
    assert values["solve"]["size"] == draft.solve.size
    assert values["solve"]["steps"] == draft.solve.steps
    assert values["solve"]["skin_tone"] == "0.5000,0.2500,0.1250"


# from Blender 4.5 on it warns; what was typed in an older one stays in the file
@pytest.mark.filterwarnings("ignore:.*does not support blend relative")
def test_every_place_on_the_disk_is_chosen_as_one_and_made_absolute(addon, tmp_path):
    properties = addon("properties")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "faces.blend"))
    item = bpy.context.scene.wildcap.captures.add()
    places = {
        name: field.metadata["path"]
        for name, field in properties.core_settings.known_settings().items()
        if "path" in field.metadata
    }
    assert len(places) >= 8
    for name, kind in places.items():
        stage, own = name.split(".")
        group = getattr(item, stage)
        assert group.bl_rna.properties[own].subtype == ('DIR_PATH' if kind == "folder" else 'FILE_PATH'), name
        for given, expected in (
            ("//mine é/", tmp_path / "mine é"),
            ("mine", Path("mine").absolute()),
            ("~/mine", Path("~/mine").expanduser()),
            ("", ""),
        ):
            setattr(group, own, given)
            assert properties.job_settings(item)[stage][own] == str(expected), name


def test_choosing_a_video_makes_a_capture_and_the_same_video_finds_it_again(addon, tmp_path):
    addon("preferences").get().captures = str(tmp_path / "captures")
    video = tmp_path / "Mon visage é.mp4"
    video.write_bytes(b"0")
    bpy.ops.wildcap.choose_video(filepath=str(video))
    bpy.ops.wildcap.choose_video(filepath=str(video))
    root = tmp_path / "captures" / "Mon visage é.wildcap"
    assert Capture(root).source == video
    assert [item.path for item in bpy.context.scene.wildcap.captures] == [str(root)]


def test_another_video_of_the_same_name_gets_its_own_folder(addon, tmp_path):
    addon("preferences").get().captures = str(tmp_path / "captures")
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "face.mp4").write_bytes(b"0")
        bpy.ops.wildcap.choose_video(filepath=str(tmp_path / folder / "face.mp4"))
    assert sorted(p.name for p in (tmp_path / "captures").iterdir()) == ["face.wildcap", "face_2.wildcap"]


def test_a_missing_video_is_a_problem_with_a_remedy(addon, tmp_path):
    with pytest.raises(RuntimeError, match="There is no file or folder"):
        bpy.ops.wildcap.choose_video(filepath=str(tmp_path / "none.mp4"))
    problem = addon("problems").of("")
    assert problem.problem and problem.remedy


def test_an_unexpected_error_is_shown_as_a_problem(addon, capture, monkeypatch):
    monkeypatch.setattr(addon("head"), "bring_in", lambda *_: 1 / 0)
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        bpy.ops.wildcap.bring_in_head()
    assert "An error inside WildCap stopped" in addon("problems").of(str(capture)).problem


def test_a_capture_of_a_newer_version_is_refused_and_left_alone(addon, tmp_path):
    root = standin.make(tmp_path / "new.wildcap")
    (root / "capture.json").write_text('{"format": 99, "stages": {}}', encoding="utf-8")
    with pytest.raises(RuntimeError, match="newer version"):
        bpy.ops.wildcap.open_capture(directory=str(root))
    assert (root / "capture.json").read_text(encoding="utf-8") == '{"format": 99, "stages": {}}'


def test_the_head_comes_in_upright_with_its_uvs_and_again_in_place(addon, capture):
    bpy.ops.wildcap.bring_in_head()
    head = bpy.context.view_layer.objects.active
    assert head["wildcap_capture"] == str(capture)
    assert tuple(head.dimensions) == pytest.approx((0.16, 0.1 - 0.1 * math.cos(0.8 * math.pi), 0.24), abs=2e-3)
    assert head.bound_box[0][1] == pytest.approx(-0.1, abs=1e-4)  # the face, towards -Y
    assert [layer.name for layer in head.data.uv_layers] == ["UVMap"]
    head.location.x = 1.0
    bpy.ops.wildcap.bring_in_head()
    assert [o.name for o in bpy.context.scene.objects] == [head.name]
    assert head.location.x == 1.0


def test_the_sample_head_opens_relightable_within_ten_seconds(addon, tmp_path):
    addon("preferences").get().captures = str(tmp_path / "captures")
    started = time.monotonic()
    bpy.ops.wildcap.open_sample_head()
    assert time.monotonic() - started < 10
    head = bpy.context.view_layer.objects.active
    assert "WildCap Skin" in head.data.materials[0].node_tree.nodes
    capture = tmp_path / "captures" / "sample_head.wildcap"
    assert head["wildcap_capture"] == str(capture)
    (capture / "maps" / "normal.png").unlink()
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wildcap.open_sample_head()  # the artist's copy, on its way to other maps, is opened as it is
    assert bpy.context.view_layer.objects.active["wildcap_capture"] == str(capture)


class FakeLayout:
    """Counts what a panel draws; every call is a layout again."""

    def __init__(self):
        self.drawn = []

    def __getattr__(self, name):
        def call(*args, **kwargs):
            self.drawn.append((name, args, kwargs))
            return (self, self) if name == "panel" else self

        return call

    def __setattr__(self, name, value):
        object.__setattr__(self, name, value)


def drawn(panel) -> list[tuple]:
    layout = FakeLayout()
    panel.draw(type("Panel", (), {"layout": layout})(), bpy.context)
    return layout.drawn


def test_what_is_wrong_with_a_video_stands_in_the_tab(addon, capture):
    from core.capture.capture import Capture
    from core.capture.messages import Problem

    doctor, status = addon("panel").WILDCAP_PT_doctor, addon("status")
    status.refresh(bpy.context)
    assert not doctor.poll(bpy.context)
    Capture(capture).stop("cameras", Problem("Nothing was seen from the left.", "Film from ear to ear."))
    status.refresh(bpy.context)
    assert doctor.poll(bpy.context)
    texts = " ".join(kwargs.get("text", "") for _, _, kwargs in drawn(doctor))
    assert "Nothing was seen from the left." in texts and "Film from ear to ear." in texts
    with pytest.raises(RuntimeError, match="no report yet"):
        bpy.ops.wildcap.open_report()


def test_a_finished_stage_can_be_done_again_from_its_row(addon, capture, monkeypatch):
    with pytest.raises(RuntimeError, match="no video"):
        bpy.ops.wildcap.reconstruct(first="scan")
    video = capture.parent / "face.mp4"
    video.write_bytes(b"0")
    Capture(capture).set_source(video)
    status = addon("status")
    monkeypatch.setattr(status.Capture, "verdict", lambda *_: status.freshness.Verdict("stale"))
    record = Capture(capture).read()
    record["stages"]["scan"] = make_entry(seconds=12.0)
    addon("status")._known.clear()
    (capture / "capture.json").write_text(json.dumps(record), encoding="utf-8")
    addon("status").refresh(bpy.context)
    rows = drawn(addon("panel").WILDCAP_PT_stages)
    buttons = [(args[0], options["icon"]) for name, args, options in rows if name == "operator"]
    assert buttons == [("wildcap.reconstruct", 'PLAY'), ("wildcap.reconstruct", 'FILE_REFRESH')], (
        "the first that is to do, and the one that is done"
    )
    started = []
    monkeypatch.setattr(addon("jobs"), "start", lambda item, goal, **span: started.append((goal, span)))
    bpy.ops.wildcap.reconstruct(first="scan")
    bpy.ops.wildcap.reconstruct()
    assert started == [
        ("reconstruct", {"first": "scan", "last": "shadow_mask"}),
        ("reconstruct", {"first": None, "last": "shadow_mask"}),
    ]


def test_moved_landmarks_are_kept_and_the_head_is_fitted_to_them_again(addon, capture, monkeypatch):
    Capture(capture).set_source(capture.parent / "face.mp4")
    bpy.ops.wildcap.bring_in_head()
    head = bpy.context.view_layer.objects.active
    with pytest.raises(RuntimeError, match="no landmarks"):
        bpy.ops.wildcap.show_landmarks()
    points = {"1": [0.0, -0.1, 0.0], "152": [0.0, -0.08, -0.1], "7": [0, 0, 0]}
    (capture / "landmarks.json").write_text(json.dumps({"points": points}), encoding="utf-8")
    bpy.ops.wildcap.show_landmarks()
    empties = {o["wildcap_landmark"]: o for o in bpy.data.collections["WildCap Landmarks"].objects}
    assert set(empties) == {1, 152} and "Chin" in empties[152].name
    head.location = (3, 2, 1)
    bpy.context.view_layer.update()
    kept = tuple(empties[152].matrix_world.translation)
    assert kept == pytest.approx((3, 1.92, 0.9), abs=1e-6), "they stay on the head"
    with pytest.raises(RuntimeError, match="No landmark was moved"):
        bpy.ops.wildcap.fit_landmarks()
    started = []
    monkeypatch.setattr(addon("jobs"), "start", lambda item, goal, **span: started.append(span))
    empties[152].location.z -= 0.004
    bpy.ops.wildcap.fit_landmarks()
    assert started == [{"first": "registration", "last": "shadow_mask"}]
    kept = json.loads((capture / "landmarks_artist.json").read_text(encoding="utf-8"))["points"]
    assert list(kept) == ["152"] and kept["152"] == pytest.approx([0, -0.08, -0.104], abs=1e-6)
    assert "WildCap Landmarks" not in bpy.data.collections
    bpy.ops.wildcap.show_landmarks()
    chin = bpy.data.collections["WildCap Landmarks"].objects["Chin Landmark"]
    assert chin.location.z == pytest.approx(-0.104, abs=1e-6)
    bpy.ops.wildcap.hide_landmarks()


def test_every_panel_draws_in_every_state(addon, capture):
    status = addon("status")
    base = addon("base_panel").WildcapPanel
    classes = [c for c in bpy.types.Panel.__subclasses__() if issubclass(c, base)]
    assert len(classes) >= 8

    def draw_all():
        seen = []
        for cls in classes:
            if not hasattr(cls, "poll") or cls.poll(bpy.context):
                seen += drawn(cls)
        return [
            kwargs.get("text", args[1] if len(args) > 1 else "") for name, args, kwargs in seen if name == "operator"
        ]

    draw_all()
    status.refresh(bpy.context)
    assert "Bring In Head" in draw_all()
    bpy.ops.wildcap.bring_in_head()
    assert "Assemble Material" in draw_all()
    bpy.ops.wildcap.paint_mask()
    assert "Save Mask and Leave" in draw_all()
    bpy.ops.wildcap.finish_mask()
    bpy.ops.wildcap.assemble_material()
    assert "Render" in draw_all()
