# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/state.md: the albedo on people like people, by the measures that tell light from skin."""

from __future__ import annotations

from .. import state
from ..figures import Figures
from ..pages import Sections

TITLE = "The state of the albedo"
SAYS = ("People like people, by the measures that tell light from skin, beside answers that do nothing or know the "
        "light.")
RECORDS = ("state",)


def sections(record: Figures) -> Sections:
    return state.sections(record.people, record.captures)
