# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/state.md: the albedo on people like people, by the measures that tell light from skin."""

from ..delighting import state
from ..figures import Figures
from ..pages import Sections

TITLE = "The state of the albedo"
SAYS = (
    "People like people, by the measures that tell light from skin, beside answers that do nothing or know the light."
)
RECORDS = ("state",)
CHOSEN = (
    "How far the fitted light counts in the delit texture was chosen on these people but the six bald, and on others. "
    "The delighter of that commit did not expect a sky yet ([what that is "
    "worth](delighters.md#after-the-solve))."
)


def sections(record: Figures) -> Sections:
    (heading, introduction), *others = state.sections(record.people, record.captures)
    return [(heading, f"{introduction} {CHOSEN}"), *others]
