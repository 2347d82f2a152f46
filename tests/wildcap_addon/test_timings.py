# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How long stages take is learned from the last ones, and known in the next Blender."""

from importlib import import_module
from types import SimpleNamespace

import pytest

pytest.importorskip("bpy")


@pytest.fixture
def timings(addon):
    module = addon("timings")
    module.unregister()
    yield module
    module._file().unlink(missing_ok=True)
    module.unregister()


def test_a_solve_tells_how_long_each_quality_takes(addon, timings):
    jobs, settings = (
        addon("jobs"),
        import_module(timings.__package__.replace("wildcap_addon", "core.settings.settings")),
    )
    standard, draft = settings.preset("standard"), settings.preset("draft")
    assert timings.describe_minutes(standard.compute_device) == ""
    done = jobs.messages.StageDone("solve", 240.0, False, {})
    jobs._hear("", jobs.Job("solve", None, settings=standard), done)
    device = standard.compute_device
    assert timings.minutes("standard", device) == pytest.approx(4.0) and "Standard" in timings.describe_minutes(device)
    ratio = timings.work(draft) / timings.work(standard)
    assert timings.minutes("draft", device) == pytest.approx(4.0 * ratio) and timings.describe_minutes("other") == ""
    timings.record(settings.from_json({"edited_part": True}), 1.0)
    jobs._hear("", jobs.Job("solve", None, settings=standard, log=["Going on after step 3."]), done)
    assert timings.minutes("standard", device) == pytest.approx(4.0), "a part is no measure"
    timings.register()
    assert timings.minutes("standard", device) == pytest.approx(4.0), "it is known in the next Blender"
    timings._file().unlink()
    timings.register()
    assert timings.minutes("standard", device) is None


def test_what_is_left_of_the_whole_is_told_from_the_last_times(addon, timings):
    jobs = addon("jobs")
    job = jobs.Job("make", None, planned=("delight", "texture", "solve"), stage="delight")
    job.progress = SimpleNamespace(eta_s=30.0)
    assert jobs.eta(job) == "30 s left"
    timings.record_stage("texture", 60.0)
    timings.record_stage("solve", 210.0)
    assert jobs.eta(job) == "30 s left, about 5 min in all"
    timings.register()
    assert timings.of_stages(("texture", "solve")) == 270.0 and timings.of_stages(("texture", "upscale")) is None
