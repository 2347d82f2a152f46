# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/hair.md: hair that is grown from pictures, against people whose every hair is known."""

from ..figures import Figures
from ..head.groomed import WORDS, shortfalls, to_table
from ..pages import Sections

TITLE = "Hair that is grown from pictures"
SAYS = "Brows and beards as curves, against people whose every hair is known."
RECORDS = ("groomed",)
PICTURE = "![From left to right a frame, the true hairs, the grown hairs](../pictures/hair.jpg)"


def sections(groomed: Figures) -> Sections:
    return [("", WORDS), ("", to_table(groomed.people)), ("", shortfalls(groomed.people)), ("", PICTURE)]
