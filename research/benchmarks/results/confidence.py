# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/confidence.md: how far the confidence map knows the error."""

from ..figures import Figures
from ..maps import confidence
from ..pages import Sections

TITLE = "Confidence"
SAYS = "How far the map that says where the albedo may be wrong is right."
RECORDS = ("confidence",)


def sections(record: Figures) -> Sections:
    return confidence.sections(record)
