# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A benchmark's record: what is written is read again, and what no table could print is refused."""

import numpy as np
import pytest

from core.capture.messages import Problem
from research.benchmarks import figures


def test_a_record_is_read_as_it_was_written(tmp_path):
    figures.write_record(
        tmp_path / "one.json",
        "demo",
        "make demo",
        {"rows": {"b": {"psnr": np.float32(0.5)}, "a": {"views": np.int64(14), "none": None}}},
    )
    record = figures.read_record("one", tmp_path)
    assert record["benchmark"] == "demo" and record["command"] == "make demo" and "commit" in record
    assert record["figures"] == {"rows": {"b": {"psnr": 0.5}, "a": {"views": 14, "none": None}}}
    assert list(record["figures"]["rows"]) == ["b", "a"]


def test_figures_of_other_captures_are_kept_where_asked(tmp_path):
    path = tmp_path / "one.json"
    figures.write_record(path, "relit", "one", {"rows": {"a": {"psnr": 1.0, "ssim": 0.5}, "b": {"psnr": 2.0}}})
    figures.write_record(path, "relit", "two", {"rows": {"a": {"psnr": 3.0}}}, keep=True)
    kept = figures.read_record("one", tmp_path)["figures"]
    assert kept == {"rows": {"a": {"psnr": 3.0, "ssim": 0.5}, "b": {"psnr": 2.0}}}
    figures.write_record(path, "relit", "two", {"rows": {"a": {"psnr": 3.0}}})
    assert figures.read_record("one", tmp_path)["figures"] == {"rows": {"a": {"psnr": 3.0}}}


@pytest.mark.parametrize("value", [float("nan"), np.float64("inf"), [1, 2], np.zeros(2)])
def test_what_is_no_figure_is_refused_by_name(tmp_path, value):
    with pytest.raises(ValueError, match=r"figures\.rows\.psnr"):
        figures.write_record(tmp_path / "one.json", "demo", "make demo", {"rows": {"psnr": value}})
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("text", [None, "no json", "[]", '{"figures": {}}'])
def test_a_file_that_is_no_record_is_a_problem(tmp_path, text):
    if text is not None:
        (tmp_path / "one.json").write_text(text, encoding="utf-8")
    with pytest.raises(Problem):
        figures.read_record("one", tmp_path)
