# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of measures: means, spreads, and paired differences with their standard errors, worked out by hand."""

import math

import pytest

from research.benchmarks import figures
from research.benchmarks.measures.table import Column, format_table, standard_error, summarise, to_record

COLUMNS = {
    "psnr": Column("PSNR, dB"),
    "flip": Column("FLIP", 3, -1),
    "step": Column("step", 2, 0),
    "unknown": Column("never measured"),
}
SCORES = {
    "old": {
        "a": {"psnr": 20.0, "flip": 0.2, "step": 0.1},
        "b": {"psnr": 30.0, "flip": 0.1},
        "c": {"psnr": 40.0},
        "d": {"psnr": 50.0},
    },
    "new": {
        "a": {"psnr": 21.0, "flip": 0.1, "step": None},
        "b": {"psnr": 31.1},
        "c": {"psnr": 41.0},
        "d": {"psnr": 50.9, "flip": math.nan},
    },
}


def test_means_spreads_and_paired_differences():
    found = summarise(SCORES, COLUMNS, "old")
    old, new = found["old"]["psnr"], found["new"]["psnr"]
    assert (old.mean, old.people, old.difference) == (35.0, 4, None) and old.spread == pytest.approx(math.sqrt(500 / 3))
    assert new.difference == pytest.approx(1.0) and new.error == pytest.approx(math.sqrt(0.02 / 3) / 2)
    assert (
        found["new"]["flip"].people == 1
        and found["new"]["flip"].spread is None
        and found["new"]["flip"].difference == pytest.approx(-0.1)
    )
    assert "step" not in found["new"] and "unknown" not in found["old"]


def test_a_standard_error_needs_two():
    assert standard_error([]) is None and standard_error([1.0]) is None
    assert standard_error([1.0, 3.0]) == pytest.approx(1.0)


def test_sure_differences_are_marked_though_people_differ_by_more():
    text = format_table(summarise(SCORES, COLUMNS, "old"), COLUMNS, "method", "old")
    assert "| method | PSNR, dB | FLIP | step |" in text and "never measured" not in text
    assert "| old | 35.00 ± 12.91 | 0.150 ± 0.071 | 0.10 |" in text and "| new | 36.00 ± 12.86 | 0.100 | - |" in text
    assert "| new | **+1.00 ± 0.04** | -0.100 | - |" in text
    turned = format_table(summarise(SCORES, COLUMNS, "new"), COLUMNS, "method", "new")
    assert "| old | *-1.00 ± 0.04* | +0.100 | - |" in turned


def test_a_record_holds_the_people_behind_the_cells(tmp_path):
    figures.write_record(
        tmp_path / "table.json", "state", "command", to_record(summarise(SCORES, COLUMNS, "old"), SCORES)
    )
    read = figures.read_record("table", tmp_path)["figures"]
    assert read["summary"]["new"]["psnr"]["difference"] == 1.0 and read["people"]["new"]["d"] == {"psnr": 50.9}
