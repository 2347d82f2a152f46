# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pages of docs/results agree with the records."""

import numpy as np
import pytest

from research.benchmarks import figures, results
from research.benchmarks.head import open_eyes
from research.benchmarks.results import delighters, index
from tests.conftest import ROOT


@pytest.mark.parametrize("name", results.NAMES)
def test_a_page_is_what_the_records_give(name):
    text = (ROOT / "docs" / "results" / f"{name}.md").read_text(encoding="utf-8")
    assert text == results.page(name), "run `make results`"


def test_every_page_is_written_and_in_the_index():
    assert results.strangers() == []
    assert sorted([*(name for group in index.GROUPS.values() for name in group), "index"]) == sorted(results.NAMES)


def test_what_survives_the_solve_is_told_of_captures_that_both_records_hold():
    def record(**psnrs):
        rows = {name: {"psnr": psnr} for name, psnr in psnrs.items()}
        return figures.Figures.of(
            {"captures": {name: {"delit texture": row, "solved": row} for name, row in rows.items()}}
        )

    before = record(tan=20.0, tan_below=22.0, scan_below=25.0, scan_leaves=26.0)
    now = record(tan=24.0, tan_below=21.0, scan_leaves=27.0, brown=30.0)
    rows = delighters.paired(before, now)
    assert rows["solved, before"] == {"tan": {"psnr": 21.0}, "scan": {"psnr": 26.0}}
    assert rows["solved"] == {"tan": {"psnr": 22.5}, "scan": {"psnr": 27.0}} == rows["delit texture"]


def test_the_true_iris_has_the_hue_that_was_painted():
    """Between pupil and rim, on a ball of the truth's size; a five-hundredth is what the painter adds to all of it."""
    colour = np.array([0.05, 0.024, 0.010])
    true = open_eyes.true_iris({"iris": colour.tolist(), "seed": 4}, 0.0155) - 0.002
    assert np.allclose(true / true[0], colour / colour[0], rtol=0.01) and true[0] == pytest.approx(0.05, rel=0.4)
