# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker's tools behind Detect, Snap to Edges and Estimate: what they find on painted skin, and how their results
wait for a click."""

import numpy as np
import pytest

from core.capture import stages
from core.capture.capture import Capture
from core.capture.messages import Failed, Reporter, StageDone
from core.imaging import images
from core.worker.job import write_job
from core.worker.runner import run_job


@pytest.fixture
def skin(tmp_path) -> Capture:
    """A face with a hard shadow and a rough mask of it."""
    pytest.importorskip("torch")
    from tests.fixtures.painted_skin import make

    return make(tmp_path / "a.wildcap")


def test_snapping_brings_a_rough_border_to_the_shadows_own(skin):
    from core.stages.solve import snapping
    from tests.fixtures.painted_skin import X, Y, settings

    rough = images.read_mask(skin.shadow_mask_auto)  # a hard disc, wider than the shadow
    report = Reporter("mask_edges")
    snapping.run(skin, settings(), report)
    snapped = images.read_mask(skin.shadow_mask_edges)
    true = 1 / (1 + np.exp((np.hypot(X - 0.66, Y - 0.55) - 0.09) / 0.006))
    assert np.abs(snapped - true).mean() < 0.4 * np.abs(rough - true).mean()
    assert 10 < report.figures["moved_percent_of_mask"] < 60
    assert not skin.shadow_mask.exists(), "the artist's mask is the artist's"


def test_a_tool_runs_as_a_job_and_leaves_no_record(skin):
    before = skin.read()
    said = []
    run_job(write_job(skin, tool="skin_tone"), said.append)
    done = next(message for message in said if isinstance(message, StageDone))
    assert done.stage == "skin_tone" and len(done.figures["skin_tone_srgb"]) == 3
    assert skin.read() == before and not skin.lock.exists()
    with pytest.raises(Exception, match="tool"):
        write_job(skin, tool="magic")


def test_a_tool_without_what_it_reads_says_what_is_missing(tmp_path):
    capture = Capture(tmp_path / "empty.wildcap")
    capture.root.mkdir()
    for tool in stages.TOOLS:
        ended = run_job(write_job(capture, tool=tool.name))
        missing = (*tool.optional_reads, *tool.reads, "no video")[0]
        assert isinstance(ended, Failed) and missing in ended.problem and ended.remedy


def test_what_a_worker_prepared_waits_for_a_click(addon, capture, monkeypatch):
    bpy = pytest.importorskip("bpy")
    session, mask_image = addon("paint.session"), addon("paint.mask_image")
    started, prepared = [], addon("jobs").before_start

    def start(**options):
        started.append(options)
        for prepare in prepared:
            prepare()

    monkeypatch.setattr(addon("jobs"), "start_tool", lambda item, tool, **options: start(tool=tool, **options))
    monkeypatch.setattr(addon("jobs"), "start", lambda item, goal, **options: start(**options))
    bpy.ops.wildcap.bring_in_head()
    with pytest.raises(RuntimeError, match="Click Paint on the Head"):
        bpy.ops.wildcap.snap_mask()
    bpy.ops.wildcap.paint_mask()
    with pytest.raises(RuntimeError, match="no snapped mask"):
        bpy.ops.wildcap.edit_mask(kind='SNAPPED')
    mine = np.zeros((64, 64), np.float32)
    mine[5:9] = 1
    mask_image.set_values(session.mask(), mine)
    bpy.ops.wildcap.snap_mask()
    assert started[0]["tool"] == "mask_edges"
    assert (capture / "shadow_mask.png").read_bytes() == mask_image.grey_png(mine)
    theirs = np.zeros((64, 64), np.float32)
    theirs[6:8] = 1
    (capture / "shadow_mask_edges.png").write_bytes(mask_image.grey_png(theirs))
    started[0]["then"]()
    assert np.array_equal(mask_image.mask_values(session.mask()), mine), "nothing changes by itself"
    bpy.ops.wildcap.edit_mask(kind='SNAPPED')
    assert np.array_equal(mask_image.mask_values(session.mask()), theirs) and session.offered() == ""
    with pytest.raises(RuntimeError, match="does not have"):
        bpy.ops.wildcap.detect_mask()
    for name in ("delit", "cameras"):
        (capture / name).mkdir()
        (capture / name / "a").write_text("")
    bpy.ops.wildcap.detect_mask()
    assert (started[1]["first"], started[1]["last"]) == ("shadow_mask", "shadow_mask")
    started[1]["then"]()
    assert session.offered() == 'PROPOSAL'
    bpy.ops.wildcap.edit_mask(kind='PROPOSAL')
    assert session.offered() == "" and mask_image.mask_values(session.mask()).max() == 0
    bpy.ops.wildcap.paint_mask(mask='PROTECT')
    with pytest.raises(RuntimeError, match="choose Shadow"):
        bpy.ops.wildcap.detect_mask()
    bpy.ops.wildcap.finish_mask()


def test_the_estimated_tone_is_marked_and_chooses_nothing(addon, capture, monkeypatch):
    bpy = pytest.importorskip("bpy")

    class Job:
        figures = {"skin_tone_srgb": [0.5, 0.25, 0.125]}

    started = []
    monkeypatch.setattr(addon("jobs"), "start_tool", lambda item, tool, **options: started.append(options) or Job())
    bpy.ops.wildcap.estimate_skin_tone()
    started[0]["then"]()
    item = addon("captures").active(bpy.context)
    assert tuple(item.estimated_tone) == tuple(item.skin_tone) == (0.5, 0.25, 0.125)
    tone = addon("properties").job_settings(item)["solve"]["skin_tone"]
    assert not item.use_skin_tone and tone == "auto", "the solve makes the same estimate"
