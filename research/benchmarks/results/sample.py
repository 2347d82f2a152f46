# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/sample.md: the sample video, whose truth is known, by `make demo`."""

from ..figures import Figures
from ..maps.albedo_score import table
from ..pages import prose

TITLE = "The sample video"
SAYS = "A synthetic face, the sun behind leaves, against its true albedo: the score that `make demo` prints."
RECORDS = ("demo",)


def sections(demo: Figures) -> str:
    return prose(
        f"""
        ![Frame, mask over the delit texture, solved albedo; the head under three lights](../pictures/teaser.jpg)

        *Above: a frame, the shadow mask over the delit texture, and the solved albedo, which keeps a faint outline of
        the leaves and a dark spot where one ends at the brow. Below: the head under the sun, three lamps and a window
        (`python -m research.benchmarks.pictures.teaser`). Scalp that no camera saw well is made up, without stubble.*

        The solved albedo against the truth, in the picture, on facial skin, mean of {demo.views} frames; the true skin
        tone is given. *After one gain*: per channel, in linear light. *Detail*: the correlation with the truth's log
        green between 1 and 3 px. *Shadow step*: log(answer / truth), lit less dark, at the shadow's edge.
        """,
        table(demo),
        """
        Other pages separate what the delighter leaves from what the solve adds: [relit](relit.md), [the head
        scan](scan.md), [the state of the albedo](state.md). The [gallery](gallery.md) shows every map.
        """,
    )
