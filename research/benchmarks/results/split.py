# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/split.md: the worth of separating skin from light."""

from ..figures import Figures
from ..maps import split
from ..pages import Sections, prose

TITLE = "Skin or light"
SAYS = "The worth of separating them, with one capture of a person and with several."
RECORDS = ("split",)
OLDER = """
    The solver of that commit held its lights back by pulls chosen by hand. Today's [splits skin and light](split.md);
    this was not measured anew.
    """
"""A caveat for pages whose solved rows are older than the split of skin and light."""


def sections(record: Figures) -> Sections:
    older = """
        The split of that commit took traits to be equally large everywhere, and to reach farther; [today's
        measurement](prior.md#how-skins-differ) leaves hair out. The picture of the parts is by today's split, its
        solved map by the solver of [the state of the albedo](state.md).
        """
    return [("", prose(older)), *split.sections(record)]
