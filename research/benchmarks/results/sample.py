# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/sample.md: the sample video, whose truth is known, by `make demo`."""

from ..figures import Figures
from ..maps.albedo_score import table
from ..pages import Sections, prose

TITLE = "The sample video"
SAYS = "A synthetic face, the sun behind leaves, against its true albedo: what `make demo` says on your machine."
RECORDS = ("demo",)


def sections(demo: Figures) -> Sections:
    return [
        (
            "",
            prose(
                f"""
        ![Frame, mask over the delit texture, solved albedo; the head under three lights](../pictures/teaser.jpg)

        *Above: a frame, the shadow mask over the delit texture, and the solved albedo, which keeps a faint outline of
        the leaves and a dark spot where one ends at the brow. Below: the head under the sun, three lamps and a window
        (`python -m research.benchmarks.pictures.teaser`). What no camera saw well of the scalp is made up, without
        stubble.*

        The solved albedo against the truth, in the picture, on facial skin; the true skin tone is given (mean of
        {demo.views} frames). *After one gain*: per channel, in linear light. *Detail*: the correlation with the truth's
        log green between 1 and 3 px. *Shadow step*: log(answer / truth), lit less dark, at the shadow's edge.
        """,
                table(demo),
                """
        What a delighter alone leaves, and what the solve adds to it, is on other pages: [relit](relit.md),
        [the head scan](scan.md), [the state of the albedo](state.md). The [gallery](gallery.md) shows every map.
        """,
            ),
        )
    ]
