# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What benchmarks put into their records has the keys by which research/benchmarks/results asks for it."""

import numpy as np
import pytest

from research.benchmarks import figures
from research.benchmarks.delighting import real_tones, skin_tone


def test_tones_are_summed_up_by_group():
    rows = {
        "frames": [("tan", 2.0, 4.0, 1.5), ("tan", -1.0, 2.0, 1.5), ("dark", 3.0, 6.0, 1.0)],
        "card": [("tan", 5.0, 7.0, 2.0)],
    }
    groups = skin_tone.summary(rows)
    assert groups["tan"]["frames"] == pytest.approx(
        {"pictures": 2, "lightness": 0.5, "rms": 2.5**0.5, "delta_e": 3.0, "stated": 1.5, "within_two": 1.0}
    )
    assert groups["tan"]["card"]["within_two"] == 0 and "card" not in groups["dark"] and "light" not in groups
    assert groups["all"]["frames"]["delta_e"] == 4 and groups["dark"]["frames"]["within_two"] == 0
    assert set(groups["all"]["frames"]) == set(figures.read_record("skin_tone")["figures"]["groups"]["all"]["frames"])


def test_agreement_is_told_against_the_best_constant():
    truth, stated = np.array([30.0, 40, 50, 60, 70]), np.full(5, 4.0)
    exact = real_tones.agreement(truth, truth, stated)
    assert exact["error ratio"] == 0 and [exact[name] for name in ("slope", "rank", "within one")] == pytest.approx(
        [1] * 3
    )
    drawn = real_tones.agreement(truth, 50 + 0.5 * (truth - 50), stated)
    assert drawn["error ratio"] == pytest.approx(0.25) and drawn["slope"] == pytest.approx(0.5)
    assert drawn["dark"] == 10 and drawn["light"] == -10 and drawn["within one"] == 0.2
    assert real_tones.agreement(truth, np.full(5, 50.0) + [0, 0, 0, 0, 1e-6], stated)["error ratio"] == pytest.approx(1)
