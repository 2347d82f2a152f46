# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which Python is fit for the worker, and what is wrong with one that is not."""

import os
import sys
from pathlib import Path

import pytest

from core.capture.messages import Problem
from core.worker import environment, locks
from core.worker.environment import judge, required, survey, verify
from core.worker.installation import find_python

REQUIREMENTS = Path(__file__).resolve().parents[3] / "requirements"


def test_a_base_python_is_found_and_fits():
    found = find_python()
    version = environment.answer(found, "import sys; print(*sys.version_info[:2])")
    assert tuple(map(int, version.split())) in locks.PYTHONS


def test_this_environment_is_judged_fit():
    found = survey(Path(sys.executable), REQUIREMENTS)
    assert set(found["versions"]) == set(required(REQUIREMENTS)) and found["device"] == "", (
        "not tried without loading anything"
    )
    assert judge(found, REQUIREMENTS) == []


def test_what_is_wrong_is_said():
    good = {
        "python": [3, 11],
        "versions": {name: version + "+cpu" for name, version in required(REQUIREMENTS).items()},
        "opencv": ["opencv-contrib-python-headless"],
        "errors": {},
        "device": "cpu",
    }
    assert judge(good, REQUIREMENTS) == []
    bad = {
        **good,
        "python": [3, 9],
        "versions": {**good["versions"], "torch": None, "av": "1.0"},
        "opencv": ["opencv-contrib-python-headless", "opencv-python"],
        "errors": {"torch": "OSError: cannot open libc10.so"},
    }
    problems = judge(bad, REQUIREMENTS)
    assert len(problems) == 5
    for words in ("3.9", "torch", "av is 1.0", "opencv-python", "libc10"):
        assert any(words in problem for problem in problems), words


@pytest.mark.parametrize("python", ["/no/such/python", os.devnull])
def test_what_is_no_python_is_told(python):
    with pytest.raises(Problem, match="not a working Python"):
        verify(Path(python), REQUIREMENTS)
