# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/hair.md: hair grown from pictures, against people whose every hair is known."""

from ..figures import Figures
from ..head.groomed import shortfalls, to_table
from ..pages import prose

TITLE = "Hair that is grown from pictures"
SAYS = "Brows and beards as curves, against people whose every hair is known."
RECORDS = ("groomed",)


def sections(groomed: Figures) -> str:
    return prose(
        """
        Four people whose every hair is known, from nine sides through a phone's pipeline (1,440 x 1,920). No other step
        of the chain lies between: cameras, head and texture are the true ones, and the face parser runs on these
        pictures. *IoU*: pixels covered by the true and by the grown hairs, seen from either side of the front.
        *Amount*: the cover that both share within 3 mm of a pixel, over the cover of either. *Anew*: IoU and amount of
        the true hairs sown anew by the same rule with other roots, the limit where pictures show no single hairs.
        *Parser*: texels to which the parser gives more than half, against those where hair grows, hidden by a fringe or
        not. *Off*: the median angle on the skin between each true hair and the nearest grown one within 3 mm, from root
        to tip; *off, usual*: the same for hair in the anatomical direction, whatever the strokes. *mm*: mean length.
        The goals are an IoU of 0.7 and 20 degrees. Only the rules for stubble were chosen on these four people. The
        clarity at which strokes outweigh the usual direction was chosen on seeds 3, 5 and 13, on which the rule that
        joins parser and strokes was also checked.

        A beard is stubble if its strokes are shorter than 2 mm and no more blue light is missing than stubble and the
        shade of a shaven beard take, as these people's generator paints it; a hair is then as long as a stroke
        (core/stages/upscale/stroke_length.py). This rule was made with these people in view, and on no others. So was
        the one that takes the parser's shares of a beard relative to its middle, for the stubbled person.

        Limits: the length of a beard is not measured, and its hairs are 6 mm long on everybody (the artist sets *Beard
        Length*). Stubble hides little of the skin, so its IoU mostly compares where hairs happen to lie close together;
        its hairs have the brows' colour. Where a fringe hides both brows, usual ones are grown, in no colour of the
        person's. Dark brows become a little wider than by dark strokes alone.
        """,
        to_table(groomed.people),
        shortfalls(groomed.people),
        "![From left to right a frame, the true hairs, the grown hairs](../pictures/hair.jpg)",
    )
