# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/even_light.md: what skin gives back of its albedo in Cycles."""

from ..figures import Figures
from ..light.even_light import WORDS, table
from ..pages import Sections

TITLE = "What skin gives back of its albedo"
SAYS = "Cycles's two random walks, and the material that makes up for what is lost."
RECORDS = ("even_light",)


def sections(record: Figures) -> Sections:
    return [("", WORDS), ("", table(record))]
