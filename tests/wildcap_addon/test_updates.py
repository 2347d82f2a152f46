# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An update of the extension loses nobody a head: what older code made is shown as such, painted on, assembled and
rendered, and nothing runs by itself."""

import sys
from pathlib import Path
from unittest.mock import Mock

import pytest

from core.capture import stages
from core.capture.capture import Capture
from tests.fixtures import standin
from tests.fixtures.drawn import drawn
from tests.fixtures.recorded import record

bpy = pytest.importorskip("bpy")


@pytest.fixture
def updated(addon, capture, item, monkeypatch) -> Path:
    """The capture's folder as if every stage had run, opened by an extension with other code."""
    standin.add_evidence(capture)
    (capture.parent / "film.mp4").write_bytes(b"film")
    folder = Capture(capture)
    folder.set_source(capture.parent / "film.mp4")
    for stage in stages.STAGES:
        for path in (capture / name for name in (*stage.reads, *stage.writes) if not folder.has(name)):
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.suffix == "":
                path.mkdir()
            else:
                maps = capture / "maps" / path.name
                path.write_bytes(maps.read_bytes() if path.parent.name == "maps_4k" else b"stands in")
    (capture / "delivery" / "one").write_bytes(b"stands in")
    monkeypatch.setattr("core.capture.freshness.code_key", lambda module: "older")
    monkeypatch.setattr(addon("status").freshness, "code_key", lambda module: "this version's")
    monkeypatch.setattr(addon("preferences"), "python", lambda: Path(sys.executable))
    for stage in stages.STAGES:
        record(folder, stage, addon("properties").settings(item))
    return capture


@pytest.fixture
def look(addon, item):
    """Function that looks at the capture, and gives the states of its stages and the next step's operator."""

    def look() -> tuple[dict, str]:
        addon("status")._known.clear()
        addon("status").refresh(bpy.context)
        step = addon("next_step").next_step(addon("panel").gather(bpy.context, item))
        return addon("status").of(item).stages, step.operator.removeprefix("wildcap.")

    return look


def test_what_older_code_made_is_shown_as_such(addon, updated, look):
    assert look()[0] == dict.fromkeys(stages.NAMES, "older")
    texts = [text for text, _ in drawn(addon("panel").WILDCAP_PT_stages)]
    assert texts.count("made by 0.2.0") == len(stages.NAMES)


def test_a_head_that_older_code_made_is_painted_on_assembled_and_rendered_and_no_stage_runs(
    addon, updated, look, monkeypatch
):
    monkeypatch.setattr(addon("jobs"), "start", started := Mock())
    before = {path: path.read_bytes() for path in updated.rglob("*") if path.is_file()}
    for operator in ("bring_in_head", "assemble_material"):
        assert look()[1] == operator, "not Solve, and not Reconstruct"
        getattr(bpy.ops.wildcap, operator)()
    bpy.context.scene.wildcap.resolution, bpy.context.scene.wildcap.samples = 16, 1
    bpy.ops.wildcap.render()
    assert (updated / "renders" / "three_point.png").is_file()
    bpy.ops.wildcap.paint_mask(on='HEAD')
    bpy.ops.wildcap.finish_mask()
    assert bpy.ops.wildcap.deliver.poll() and not started.called
    changed = {path.relative_to(updated).as_posix() for path, content in before.items() if path.read_bytes() != content}
    assert changed <= {"report.html", "written.jsonl"}, "a look, a material and a render change nothing that was made"
