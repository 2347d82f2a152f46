# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a test expects of a refusal."""

import pytest

from core.capture.messages import Problem


def refused(call, *words: str) -> Problem:
    """The Problem of a call: it says each of these words, and what to do."""
    with pytest.raises(Problem) as told:
        call()
    for word in words:
        assert word in str(told.value), told.value
    assert told.value.problem.endswith(".") and told.value.remedy.endswith(".")
    return told.value
