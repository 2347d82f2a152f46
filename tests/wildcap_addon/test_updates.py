# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An update of the extension loses nobody a head: what older code made is shown as such, painted on, assembled and
rendered, and nothing runs by itself."""

import sys
from pathlib import Path

import pytest

from core.capture import stages
from core.capture.capture import Capture
from tests.fixtures import standin
from tests.fixtures.drawn import drawn
from tests.fixtures.recorded import record

bpy = pytest.importorskip("bpy")


@pytest.fixture
def updated(addon, tmp_path, monkeypatch):
    """The stand-in's capture as if every stage had run, opened by an extension with other code. Returns its folder."""
    root = standin.make(tmp_path / "head.wildcap")
    standin.add_evidence(root)
    film = tmp_path / "film.mp4"
    film.write_bytes(b"film")
    made = Capture(root)
    made.set_source(film)
    for stage in stages.STAGES:
        for path in (root / name for name in (*stage.reads, *stage.writes) if not made.has(name)):
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.suffix == "":
                path.mkdir()
            elif path.parent.name == "maps_4k":
                path.write_bytes((root / "maps" / path.name).read_bytes())
            else:
                path.write_bytes(b"stands in")
    (root / "delivery" / "one").write_bytes(b"stands in")
    bpy.ops.wildcap.open_capture(directory=str(root))
    settings = addon("properties").settings(addon("captures").active(bpy.context))
    for stage in stages.STAGES:
        record(made, stage, settings)
    monkeypatch.setattr(addon("status").freshness, "code_key", lambda module: "this version's")
    monkeypatch.setattr(addon("preferences"), "python", lambda: Path(sys.executable))
    return root


def look(addon):
    addon("status")._known.clear()
    addon("status").refresh(bpy.context)
    return addon("status").of(addon("captures").active(bpy.context))


def next_operator(addon) -> str:
    facts = addon("panel").gather(bpy.context, addon("captures").active(bpy.context))
    return addon("next_step").next_step(facts).operator


def test_what_older_code_made_is_shown_as_such_and_can_be_made_again_by_a_click(addon, updated, monkeypatch):
    assert look(addon).stages == dict.fromkeys(stages.NAMES, "older")
    texts = [text for text, _ in drawn(addon("panel").WILDCAP_PT_stages)]
    assert texts.count("made by 0.2.0") == len(stages.NAMES)
    started: list = []
    monkeypatch.setattr(addon("jobs"), "start", lambda item, goal, **span: started.append(span["first"]))
    bpy.ops.wildcap.reconstruct(first="scan")
    assert started == ["scan"], "begun with this stage, which makes it again"


def test_a_head_that_older_code_made_is_painted_on_assembled_and_rendered_and_no_stage_runs(
    addon, updated, monkeypatch
):
    started: list = []
    monkeypatch.setattr(addon("jobs"), "start", lambda *given, **named: started.append((given, named)))
    before = {path: path.read_bytes() for path in updated.rglob("*") if path.is_file()}
    look(addon)
    assert next_operator(addon) == "wildcap.bring_in_head"
    bpy.ops.wildcap.bring_in_head()
    assert next_operator(addon) == "wildcap.assemble_material", "not Solve, and not Reconstruct"
    bpy.ops.wildcap.assemble_material()
    bpy.context.scene.wildcap.resolution, bpy.context.scene.wildcap.samples = 16, 1
    bpy.ops.wildcap.render()
    assert (updated / "renders" / "three_point.png").is_file()
    bpy.ops.wildcap.paint_mask(on='HEAD')
    bpy.ops.wildcap.finish_mask()
    assert bpy.ops.wildcap.deliver.poll()
    assert started == []
    unlike = {path.relative_to(updated).as_posix() for path, content in before.items() if path.read_bytes() != content}
    assert unlike <= {"report.html", "written.jsonl"}, "a look, a material and a render change nothing that was made"


def test_a_mask_painted_after_the_update_asks_for_a_solve_alone(addon, updated):
    (updated / "shadow_mask.png").write_bytes(standin.plain((255,)))
    states = look(addon).stages
    assert {name for name, state in states.items() if state == "stale"} == {"solve"}
    bpy.ops.wildcap.bring_in_head()
    look(addon)
    assert next_operator(addon) == "wildcap.solve"
    older = {name for name, state in states.items() if state == "older"}
    assert older == set(states) - {"solve"}, "what lies under the mask stays as it is"
