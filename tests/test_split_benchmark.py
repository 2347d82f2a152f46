# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far traits reach is measured as it was laid in; what is measured can be kept as a record."""

import numpy as np
import pytest

from benchmarks import figures, split
from benchmarks.measures.table import summarise, to_record


def test_the_correlation_of_a_known_field_falls_as_it_was_made():
    """A field on a line whose correlation is exp(-distance / 20 mm)."""
    rng, places = np.random.default_rng(0), np.linspace(0, 80, 161)
    lower = np.linalg.cholesky(np.exp(-np.abs(places[:, None] - places) / 20) + 1e-9 * np.eye(161))
    fields = (lower @ rng.standard_normal((161, 4000))).T
    i, j = rng.integers(0, 161, (2, 20000))
    found = split.correlation_by_distance((fields[:, i] * fields[:, j]).mean(0), np.abs(places[i] - places[j]))
    for name, value in found.items():
        low, high = (float(word) for word in name.removesuffix(" mm").split(" to "))
        assert np.exp(-high / 20) - 0.05 < value < np.exp(-low / 20) + 0.05, name


def test_a_record_holds_plain_figures_and_the_tables_their_numbers():
    scores = {method: {"somebody": dict.fromkeys(split.COLUMNS, value)}
              for method, value in ((split.DELIT, 20.0), (split.SOLVED, 21.5))}
    skins = {"skins": 9, "deviation": 0.2, "same side": {"0 to 4 mm": 1.0}, "mirror image": {"0 to 4 mm": 0.7}}
    scales = {"somebody": {"traits": 0.1, "light": 0.2, "local": 0.3, "noise": 0.4}}
    captures = {"somebody": {split.DELIT: 20.0, split.SOLVED: 21.5}}
    record = {**to_record(summarise(scores, split.COLUMNS, split.DELIT), scores), "captures": captures,
              "scales": scales, "skins": skins}
    assert figures.plain(record)["captures"]["somebody"][split.SOLVED] == pytest.approx(21.5)
    assert "+1.50" in split.capture_table(
        captures
    ) and "| somebody | 0.100 | 0.200 | 0.300 | 0.400 |" in split.scale_table(scales)
    assert "| mirror image | 0.7 |" in split.reach_table(skins)
