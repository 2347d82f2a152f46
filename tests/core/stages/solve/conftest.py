# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Solves of these tests fit their light in a sixth of the steps, most of their time at this size."""

from dataclasses import replace

import pytest

from core.solver.recipes import OURS, RECIPES


@pytest.fixture(scope="module", autouse=True)
def brief_light():
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(RECIPES, "wildcap", replace(OURS, updates=OURS.updates // 6))
        yield


@pytest.fixture
def full_light(monkeypatch):
    """For tests in which the light has to be found, or a worker of its own solves."""
    monkeypatch.setitem(RECIPES, "wildcap", OURS)
