# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/promises.md: every sentence of what is promised names tests, and they are there."""

import ast
import re
from pathlib import Path

import pytest

from research.benchmarks import figures, hostile, kills

TESTS = Path(__file__).resolve().parent
PAGE = (TESTS.parent / "docs" / "promises.md").read_text(encoding="utf-8")
PROMISED = PAGE[: PAGE.index("## What is not promised yet")]
PROMISES = [line for line in PROMISED.replace("\n  ", " ").splitlines() if line.startswith("- ")]


@pytest.mark.parametrize("promise", PROMISES, ids=lambda line: line[2:40])
def test_a_promise_is_held_by_tests(promise):
    named = re.findall(r"`(test_[a-z0-9_]+\.py)(?:::(test_[a-z0-9_]+))?`", promise)
    assert named, "it names no test"
    for file, name in named:
        functions = {
            node.name
            for node in ast.parse((TESTS / file).read_text(encoding="utf-8")).body
            if isinstance(node, ast.FunctionDef)
        }
        assert name in functions if name else any(each.startswith("test_") for each in functions), f"{file}::{name}"


@pytest.mark.parametrize("benchmark", [hostile, kills], ids=["hostile", "kills"])
def test_how_it_was_tried_is_what_the_record_says(benchmark):
    record = figures.read_record(benchmark.__name__.rsplit(".", 1)[1])["figures"]
    counted = "--count {} --seed {}".format(
        record["all"]["cases"] if "all" in record else record["rows"]["all"]["trials"], record["seed"]
    )
    assert benchmark.table(record) in PAGE and counted in PAGE


def test_the_page_makes_promises():
    assert len(PROMISES) > 12
