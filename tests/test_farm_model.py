# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a farm costs, on paper: sums that can be done in the head, and the page that is what its record and today's
costs give."""

import sys

import pytest

from benchmarks import farm_model, figures
from benchmarks.farm_model import Assumptions, entries, model_farm, page, weigh
from core.contract import stages
from core.contract.capture import Capture
from core.contract.messages import Problem

STARTS = {name: {"seconds": 9.0, "processor_s": 1.0} for name in farm_model.STARTS}
EVEN = Assumptions(
    faces=1000,
    eur_core_hour=0.1,
    eur_gpu_hour=1.0,
    eur_gb_month=0.5,
    eur_artist_hour=30.0,
    months=2.0,
    repeats=0.0,
    gpu_solve_minutes=6.0,
    gate_minutes=1.5,
    film_mb=100.0,
    storage_mb_s=100.0,
    workers=10,
)


def costs(**other) -> dict:
    """Ten stages of 36 s each on four cores, of which they use two."""
    stage = {"seconds": 36.0, "processor_s": 72.0, "peak_mb": 2000}
    standard = dict.fromkeys(stages.NAMES, stage) | {"solve": {**stage, "peak_mb": 6000}}
    return {"machine": {"cores": 4, "processor": "a processor", "networks": "float32"}, "standard": standard, **other}


def disk(size: float = 10.0) -> dict[str, float]:
    return dict.fromkeys([*entries(name for stage in stages.STAGES for name in stage.writes), "all else"], size)


def test_the_sums_are_those_of_the_formulas():
    found = model_farm(costs(), disk(), STARTS, EVEN)
    totals, weight = found["totals"], 10.0 * len(disk())
    assert (
        found["seconds"] == 360.0
        and found["gb"] == pytest.approx((weight + 100) / 1000)
        and found["gb_slim"] == pytest.approx((weight + 80) / 1000)
    )
    assert (
        totals["core_hours"] == 400.0
        and totals["used_core_hours"] == pytest.approx(200.0)
        and totals["eur_cores"] == pytest.approx(40.0)
    )
    # two of ten stages are the task solve
    assert totals["gpu_hours"] == pytest.approx(100.0) and totals["core_hours_beside_gpu"] == pytest.approx(320.0)
    assert totals["eur_with_gpu"] == pytest.approx(132.0)
    assert totals["tb"] == pytest.approx(found["gb"]) and totals["eur_disk"] == pytest.approx(1000 * found["gb"])
    assert totals["artist_hours"] == 25.0 and totals["eur_artist"] == 750.0
    assert totals["days"] == pytest.approx(10 / 24)  # 100 faces of 6 minutes for each worker
    assert (
        found["limits"]["artist"] == 4.0
        and found["limits"]["gb_a_core"] == 1.5
        and found["limits"]["start_share"] == pytest.approx(36 / 396)
    )


def test_twice_the_faces_cost_twice_as_much_and_repeats_cost_the_machines_alone():
    once, twice = (model_farm(costs(), disk(), STARTS, Assumptions(faces=faces))["totals"] for faces in (10, 20))
    assert {key: pytest.approx(2 * value) for key, value in once.items()} == twice
    plain, again = (model_farm(costs(), disk(), STARTS, Assumptions(repeats=share))["totals"] for share in (0.0, 0.5))
    assert {key for key in plain if again[key] == pytest.approx(1.5 * plain[key])} == {
        "used_core_hours",
        "core_hours",
        "eur_cores",
        "gpu_hours",
        "core_hours_beside_gpu",
        "eur_with_gpu",
        "days",
    }
    assert all(again[key] == plain[key] for key in ("tb", "eur_disk", "artist_hours"))


def test_a_task_reads_what_comes_before_it_and_writes_its_own():
    tasks = model_farm(costs(), disk(), STARTS, EVEN)["tasks"]
    # the film; frames, cameras, scan, head, landmarks
    assert (tasks["head"]["read_mb"], tasks["head"]["write_mb"]) == (100.0, 50.0)
    assert (
        tasks["mask"]["write_mb"] == 50.0
        and tasks["solve"]["write_mb"] == 20.0
        and tasks["deliver"]["write_mb"] == 10.0
    )
    assert tasks["mask"]["read_mb"] == 100.0 + 40.0 and tasks["deliver"]["read_mb"] > tasks["solve"]["read_mb"]
    slow = model_farm(costs(), disk(), STARTS, EVEN)["limits"]["storage"]
    assert slow == pytest.approx(100.0 * 360.0 / sum(task["read_mb"] + task["write_mb"] for task in tasks.values()))


def test_other_numbers_of_frames_are_told_where_they_were_measured_to_their_end():
    fast = {"seconds": 6.0, "processor_s": 7.0, "peak_mb": 1}
    rows = {
        "frames-300": dict.fromkeys(("frames", "cameras", "scan"), fast),
        "frames-30": dict.fromkeys(("frames", "cameras", "scan"), fast),
        "frames-120": {"frames": fast, "cameras": {"over_s": 480.0}},
        "views-8": {"delight": fast},
    }
    found = model_farm(costs(**rows), disk(), STARTS, EVEN)["frames"]
    assert list(found) == ["30", "300"] and found["30"]["seconds"] == 7 * 36 + 3 * 6
    assert "| 300 | 270 s |" in page(model_farm(costs(**rows), disk(), STARTS, EVEN))
    assert "With other numbers" not in page(model_farm(costs(), disk(), STARTS, EVEN))


def test_a_capture_is_weighed_by_what_its_stages_write(tmp_path):
    capture = Capture(tmp_path / "a.wildcap")
    for name in (name for stage in stages.STAGES for name in stage.writes):
        path = capture.root / (f"{name}x.bin" if name.endswith("/") else name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"0" * 1_000_000)
    (capture.root / "maps_4k" / "more.png").write_bytes(b"0" * 500_000)
    (capture.root / "report.html").write_bytes(b"0" * 250_000)
    found = weigh(capture)
    assert found["frames"] == 1.0 and found["maps_4k"] == len(stages.MAPS) + 0.5 and found["all else"] == 0.25
    (capture.root / "head.obj").unlink()
    with pytest.raises(Problem, match=r"head\.obj is missing"):
        weigh(capture)


def test_costs_without_a_whole_standard_row_are_refused():
    whole = costs()
    whole["standard"] = {key: value for key, value in whole["standard"].items() if key != "upscale"}
    with pytest.raises(Problem, match="no whole row 'standard'"):
        model_farm(whole, disk(), STARTS, EVEN)


def test_the_page_is_what_the_record_and_todays_costs_give():
    record = figures.read_record("farm_model")["figures"]
    again = model_farm(
        figures.read_record("costs")["figures"], record["disk_mb"], record["starts"], Assumptions(**record["assumed"])
    )
    assert figures.plain(again) == record and farm_model.PAGE.read_text(encoding="utf-8") == page(record), (
        f"run `{farm_model.COMMAND.split(' --cap')[0]}`"
    )
    assert record["assumed"] == vars(Assumptions())


def test_the_command_uses_measurements_again_and_takes_other_assumptions(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(
        sys,
        "argv",
        ["farm_model", "--faces", "200", "--json", str(tmp_path / "x.json"), "--page", str(tmp_path / "x.md")],
    )
    assert farm_model.main() == 0 and "# What 200 faces cost" in (tmp_path / "x.md").read_text(encoding="utf-8")
    written, published = figures.read_record("x", tmp_path), figures.read_record("farm_model")
    assert written["figures"]["disk_mb"] == published["figures"]["disk_mb"]
    monkeypatch.setattr(figures, "PUBLISHED", tmp_path)
    assert farm_model.main() == 2 and "Add --capture CAPTURE" in capsys.readouterr().err
    monkeypatch.setattr(sys, "argv", ["farm_model", "--capture", str(tmp_path)])
    assert farm_model.main() == 2 and "is not a finished capture" in capsys.readouterr().err
    assert set(farm_model.time_starts(1)["command"]) == {"seconds", "processor_s"}
