# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the chain costs: a table says what was measured, what was not and what was disturbed; the processor's time is
counted as it was spent."""

import json
import os
import time
from types import SimpleNamespace

import numpy as np
import pytest
from research.benchmarks.results.blender import acting_table

from core.capture import stages
from core.capture.capture import Capture
from core.capture.files import write_json
from research.benchmarks import costs, figures
from research.benchmarks.costs import __main__ as terminal
from research.benchmarks.costs import chain, meter
from research.benchmarks.costs.rows import GROWTH, ROWS, WHOLES, StageRun, growth, table, together
from research.benchmarks.costs.stage import measure_stage, over, preset

DONE = {"seconds": 12.4, "processor_s": 20.0, "peak_mb": 1640, "load": 0.1, "others": 0.05}
TICKS = os.sysconf("SC_CLK_TCK")


def lines(text):
    """First cell of each row -> its other cells, of the last table that has it."""
    return {
        cells[0].strip(" *"): [cell.strip() for cell in cells[1:]]
        for line in text.splitlines()
        if (cells := line.strip("|").split("|"))
    }


def test_what_a_face_that_was_filmed_with_open_eyes_had_already_is_no_click():
    cost = {
        "plain": {"seconds": 10.2, "peak_mib": 1024.0},
        "add_face_units": None,
        "close_up": {"seconds": 4.12, "mib": 81.6},
        "grow_hair": {"seconds": 1.3, "mib": 18.2},
        "render": {"seconds": 11.0, "peak_mib": 1536.0},
        "hairs": 9,
        "vertices": 8,
    }
    assert lines(acting_table(figures.Figures.of({"faces": {"a": cost}}).faces))["a"] == [
        "with the material",
        "4.1 s, 82 MiB",
        "1.3 s, 18 MiB",
        "9",
        "8",
        "10 s, 1.0 GiB",
        "11 s, 1.5 GiB",
    ]


def test_table_says_what_was_measured_what_not_and_what_was_disturbed():
    found = {
        "machine": {},
        "standard": {**dict.fromkeys(stages.NAMES, DONE), "solve": {**DONE, "others": 0.74}},
        "draft": {"solve": {**DONE, "seconds": 3.6}},
        "solve-2048": {"solve": {"over_s": 600.0, "load": 0.0}},
        "solve-512": {"solve": {**DONE, "processor_s": 5.0}},
        "frames-60": {"frames": {**DONE, "others": None}},
    }
    found["together"] = {whole: together(found, whole) for whole in ("standard", "float32")}
    assert together(found, "draft") is None, "a stage of it was not measured"
    assert found["together"]["standard"] == {"minutes": 2.1, "processor_minutes": 3.3, "peak_mb": 1640, "others": 0.74}
    found["growth"] = {title: growth(found, values, grown) for title, values, grown in GROWTH}
    text = table(found)
    stages_of, sides = map(lines, text.split("\n\n"))
    assert stages_of["frames"] == ["12 s, 1.6 GB"] * 3, "those of float32 and of the draft are the standard's"
    assert stages_of["scan"] == ["12 s, 1.6 GB", "12 s, 1.6 GB", "-"]
    assert stages_of["together"] == ["**2.1 min, 1.6 GB**", "-", "-"]
    assert stages_of["solve"] == ["12 s, 1.6 GB (20 s of processor; others took 0.7 cores)", "-", "4 s, 1.6 GB"]
    assert sides["solve"] == ["12 s, 1.6 GB", stages_of["solve"][0], "over 600 s", "2.00 (2)"]
    assert "upscale" not in sides, "one value alone tells of no growth"
    assert "cells" not in text and "views" not in text, "where only one size was measured nothing is seen to grow"


@pytest.mark.parametrize("power", [0.0, 1.0, 2.5])
def test_the_exponent_is_that_of_the_growth(power):
    found = {f"frames-{count}": {"cameras": {**DONE, "processor_s": 3 * count**power}} for count in (60, 120, 1000)}
    _, values, grown = next(entry for entry in GROWTH if entry[0] == "frames")
    assert growth(found, values, grown) == {"cameras": {"exponent": power, "points": 3}}


def test_every_row_is_in_a_table():
    shown = {(row, stage) for _, _, grown in GROWTH for stage, rows in grown.items() for row in rows}
    assert {(name, stage) for name, row in ROWS.items() if name not in WHOLES[:3] for stage in row.stages} <= shown
    assert all(
        len(rows) == len(values) and set(rows) <= {*ROWS, ""} for _, values, grown in GROWTH for rows in grown.values()
    )


def test_idle_and_waiting_processors_are_not_busy():
    first = " ".join(str(seconds * TICKS) for seconds in (2, 3, 5, 100, 50, 7, 11, 13, 1, 0))
    assert meter.busy_of(f"cpu  {first}\ncpu0 1 1 1 1 1 1 1 1 1 1\nintr 12\n") == 2 + 3 + 5 + 7 + 11 + 13


def test_seconds_of_a_block_are_the_clocks_and_the_processors():
    with meter.spending() as spent:
        time.sleep(0.3)
        began = time.process_time()
        while time.process_time() - began < 0.1:  # threads that other tests left may have taken some of it already
            pass
    assert 0.1 <= spent.processor_s < spent.seconds and spent.seconds >= 0.3


def test_a_process_alone_is_measured_to_its_end_or_its_limit():
    ran = meter.run_alone(["-c", "import time\ntime.sleep(0.3)\nwhile time.process_time() < 0.2: pass\nprint('done')"])
    assert ran.checked().said == "done\n" and ran.seconds > 0.4 and ran.processor_s == pytest.approx(0.2, abs=0.15)
    failed = meter.run_alone(["-c", "raise SystemExit(3)"])
    with pytest.raises(ChildProcessError, match="code 3"):
        failed.checked()
    began = time.monotonic()
    ended = meter.run_alone(["-c", "import time; time.sleep(60)"], limit_s=0.2)
    assert ended.code is None and time.monotonic() - began < 10


@pytest.mark.parametrize("record", ["costs"])
def test_a_record_is_made_by_a_command_that_exists(record, capsys):
    word = figures.read_record(record)["command"].removeprefix("python -m research.benchmarks.costs ").split()[0]
    assert f"research.benchmarks.costs {word} " in costs.__doc__ and f"research/records/{record}.json" in costs.__doc__
    with pytest.raises(SystemExit) as ended:
        terminal.main([word, "--help"])
    assert ended.value.code == 0 and f"usage: python -m research.benchmarks.costs {word}" in capsys.readouterr().out


def test_settings_may_lie_beyond_their_range_but_must_exist():
    beyond = over(preset("draft"), {"solve": {"size": 2048}})
    assert beyond.solve.size == 2048 and beyond.solve.guidance == "proximal"
    with pytest.raises(TypeError):
        over(beyond, {"solve": {"sise": 2048}})


def test_stage_that_fails_and_stage_that_takes_too_long_are_told(tmp_path):
    cost = measure_stage(tmp_path / "a.wildcap", "shadow_mask")
    assert set(cost) == {"problem", "remedy"} and "delit/" in cost["problem"]
    began = time.monotonic()
    assert measure_stage(tmp_path / "a.wildcap", "solve", limit_s=0.05)["over_s"] == 0.05
    assert time.monotonic() - began < 2


def test_goes_on_where_it_was_stopped(tmp_path, monkeypatch):
    asked, options = (
        [],
        SimpleNamespace(
            work=tmp_path, json=tmp_path / "costs.json", capture=None, film=chain.VIDEO, limit_s=600, again=False
        ),
    )
    found_on = chain.machine()

    def measure(capture, stage, *given):
        asked.append(stage)
        capture.mkdir(exist_ok=True)
        return (
            {"problem": "The disk is full.", "remedy": "Free some space."}
            if stage == "scan" and asked.count("scan") == 1
            else DONE
        )

    monkeypatch.setattr(chain, "measure_stage", measure)
    whole = list(stages.NAMES)
    assert not chain.measured("frames-120", options), "the scan failed"
    assert chain.measured("frames-120", options) and asked == [*whole[:3], *whole[2:]]
    assert chain.measured("frames-120", options) and len(asked) == len(whole) + 1, "all is there"
    record = figures.read_record("costs", tmp_path)["figures"]
    assert record["frames-120"] == dict.fromkeys(whole, DONE) and record["together"]["frames-120"]["minutes"] == 2.1
    options.again = True
    assert chain.measured("frames-120", options) and len(asked) == len(whole) + 1, "nothing disturbed it"
    with pytest.raises(chain.Problem, match="row standard first"):
        chain.measured("solve-512", options)
    monkeypatch.setattr(chain, "machine", lambda: {**found_on, "cores": 1000})
    with pytest.raises(chain.Problem, match=r"another machine \(cores\)"):
        chain.measured("solve-512", options)


def test_what_was_disturbed_is_measured_once_more_and_the_better_one_kept(tmp_path, monkeypatch):
    options = SimpleNamespace(
        work=tmp_path, json=tmp_path / "costs.json", capture=None, film=None, limit_s=600, again=True
    )
    busy = {"frames": [0.1], "cameras": [0.9, 1.5, 0.3, 0.0], "scan": [0.0]}
    capture = tmp_path / "standard.wildcap"
    monkeypatch.setitem(ROWS, "standard", StageRun(("frames", "cameras", "scan")))

    def measure(capture, stage, *given):
        capture.mkdir(exist_ok=True)
        return {**DONE, "others": busy[stage].pop(0)}

    monkeypatch.setattr(chain, "measure_stage", measure)
    kept = []
    for _ in range(5):
        assert chain.measured("standard", options)
        kept.append(figures.read_record("costs", tmp_path)["figures"]["standard"]["cameras"]["others"])
    assert kept == [0.9, 0.9, 0.3, 0.0, 0.0] and capture.is_dir()


def test_video_is_played_to_and_fro_with_new_noise():
    steps = [np.full((24, 32, 3), 40 * i + 20, np.uint8) for i in range(5)]
    frames = list(chain.to_and_fro(steps, 11))
    assert [round((255 * float(frame.mean()) - 20) / 40) for frame in frames] == [0, 1, 2, 3, 4, 3, 2, 1, 0, 1, 2]
    noise = 255 * np.std(frames[3] - frames[5])
    assert noise == pytest.approx(chain.NOISE * 2**0.5, rel=0.05), "the same picture, but for the noise"
    assert frames[0].dtype == np.float32 and max(frame.max() for frame in frames) <= 1
    assert chain.length(chain.VIDEO) == 60


def test_views_are_chosen_anew(tmp_path):
    capture = Capture(tmp_path)
    frames = [
        {"name": f"{i:05d}.jpg", "sharpness": 0.5 + 0.01 * (i % 3), "yaw_deg": float(3 * i - 45), "selected": True}
        for i in range(30)
    ]
    write_json(capture.frames_json, {"kind": "video", "frames": frames})
    chain.select(capture, 8)
    chosen = [
        i
        for i, frame in enumerate(json.loads(capture.frames_json.read_text(encoding="utf-8"))["frames"])
        if frame["selected"]
    ]
    assert len(chosen) == 8 and max(np.diff(chosen)) <= 6, "spread over the turn"
