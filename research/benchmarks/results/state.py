# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/state.md: the albedo of lifelike people, by measures that separate light from skin."""

from ..delighting import state
from ..figures import Figures
from ..pages import Sections

TITLE = "The state of the albedo"
SAYS = "Lifelike people, by measures that separate light from skin, beside answers that do nothing or know the light."
RECORDS = ("state",)
CHOSEN = (
    "The weight of the fitted light in the delit texture was chosen on these people but the six bald, and on others. "
    "The delighter of that commit did not expect a sky yet ([its worth](delighters.md#after-the-solve))."
)


def sections(record: Figures) -> Sections:
    (heading, introduction), *others = state.sections(record.people, record.captures)
    return [(heading, f"{introduction} {CHOSEN}"), *others]
