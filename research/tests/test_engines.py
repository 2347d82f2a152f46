# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of the two engines, from ratios that are known."""

from research.benchmarks import engines


def test_each_light_is_a_row_of_three_channels_per_column():
    ratios = {"red": 1.0, "green": 1.1204, "blue": 0.9}
    lines = engines.table({"three_point": {what: ratios for what in engines.SHOWN}}).splitlines()
    assert lines[0] == "| light | no subsurface | WildCap Skin | the same, Random Walk, as in 0.1.0 |"
    assert (
        lines[2] == "| three point | 1.000, 1.120, 0.900 | 1.000, 1.120, 0.900 | 1.000, 1.120, 0.900 |"
        and len(lines) == 3
    )
