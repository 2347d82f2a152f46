# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/split.md: what telling skin and light apart is worth."""

from __future__ import annotations

from .. import split
from ..figures import Figures
from ..pages import Sections

TITLE = "Skin or light"
SAYS = "What telling them apart is worth, with one capture of a person and with several."
RECORDS = ("split",)
OLDER = """
    The solver of that commit held its lights back by pulls chosen by hand; today's
    [splits skin and light](split.md), and this was not measured anew.
    """
"""A caveat for pages whose solved rows are older than the split of skin and light."""


def sections(record: Figures) -> Sections:
    return split.sections(record)
