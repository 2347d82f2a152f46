# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""No name that is persisted or addressed from outside changes by accident."""

import json
import subprocess

import pytest

from research.benchmarks import inventory

RECORDED = json.loads(inventory.RECORD.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def present() -> dict:
    if subprocess.run(["git", "rev-parse"], cwd=inventory.ROOT, capture_output=True).returncode:
        pytest.skip("not a git checkout")
    return inventory.take_inventory()


@pytest.mark.parametrize("kind", RECORDED)
def test_names_are_those_that_were_recorded(present, kind):
    assert present[kind] == RECORDED[kind], "if that is meant, run `python -m research.benchmarks.inventory`"
    assert len(present) == len(RECORDED)
