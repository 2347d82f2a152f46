# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/shadows.md: the proposed mask."""

from ..figures import Figures, markdown, number
from ..pages import Sections, prose

TITLE = "Shadow masks"
SAYS = "The proposed mask against the true shadow."
RECORDS = ("shadow_mask",)
SCORES = {"iou": "IoU", "border_f": "border F"}
COLUMNS = ("true", "masked", "iou", "precision", "recall", "border_f")


def sections(proposed: Figures) -> Sections:
    seconds = proposed.processor_seconds
    rows = [[row.capture, row.delighter, *(number(row[key], 2) for key in COLUMNS)] for row in proposed.rows.values()]
    setup = """
        The proposal against the true shadow (all that the sun does not reach, the side turned away included), over the
        facial skin that was seen; the border's F-score is at 3 texels of a 1024 map. Four synthetic people on whom
        nothing was chosen, under a sun that head, leaves, blinds or an edge block, in eight frames of 480 x 640; the
        registered head is half a millimetre off. With the delighter `shading` the frames vote; `none` tells nothing
        about shadows, so a sun is fitted to the filmed texture.
        """
    limits = f"""
        Most of the scan's face is in shadow, which makes its IoU an easy one. The stage takes {seconds.delit} s of one
        processor for sample and scan, {seconds.filmed_least} to {seconds.filmed_most} s if the sun is fitted to the
        texture. Occlusion is found where shape and texture agree; `shading` divides it out, so little is left to find
        after it. The proposal has not been measured on real people, whose shadows nobody has drawn.
        """
    head = ["capture", "delighter", *(SCORES.get(key, key) for key in COLUMNS)]
    return [("The mask that finds itself", prose(setup, markdown(head, rows), limits))]
