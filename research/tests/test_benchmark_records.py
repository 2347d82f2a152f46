# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What benchmarks put into their records has the keys by which research/benchmarks/results asks for it."""

import pytest

from research.benchmarks import figures
from research.benchmarks.delighting import skin_tone


def test_tones_are_summed_up_by_group():
    rows = {
        "scene": [("tan", 2.0, 4.0, 1.5), ("tan", -1.0, 2.0, 1.5), ("dark", 3.0, 6.0, 1.0)],
        "measured": [("tan", 5.0, 7.0, 2.0)],
    }
    found = skin_tone.summary(rows, {"tan": 1, "dark": 1})
    assert found["tan"]["scene"] == pytest.approx(
        {"lightness": 0.5, "rms": 2.5**0.5, "delta_e": 3.0, "stated": 1.5, "within_two": 1.0}
    )
    assert found["tan"]["measured"]["within_two"] == 0 and "measured" not in found["dark"]
    assert (
        found["all"]["subjects"] == 2
        and found["all"]["scene"]["delta_e"] == 4
        and found["dark"]["scene"]["within_two"] == 0
    )
    assert set(found["all"]["scene"]) == set(figures.read_record("skin_tone")["figures"]["groups"]["all"]["scene"])
