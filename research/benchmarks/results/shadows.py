# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/shadows.md: the mask that is proposed."""

from ..figures import Figures, markdown, number
from ..pages import Sections, prose

TITLE = "Shadow masks"
SAYS = "The proposed mask against the true shadow."
RECORDS = ("shadow_mask",)
SCORES = {
    "true": "true",
    "masked": "masked",
    "iou": "IoU",
    "precision": "precision",
    "recall": "recall",
    "border_f": "border F",
}


def sections(proposed: Figures) -> Sections:
    seconds = proposed.processor_seconds
    return [
        (
            "The mask that finds itself",
            prose(
                """
        The proposal against the true shadow (where the sun does not reach, the side turned away included), over the
        facial skin that was seen; the border's F-score at 3 texels of a 1024 map. Four synthetic people on whom nothing
        was chosen, under a sun that head, leaves, blinds or an edge block, eight frames of 480 x 640, the registered
        head half a millimetre off. With the delighter `shading` the frames vote; `none` says nothing of shadows, so a
        sun is fitted to the filmed texture.
        """,
                markdown(
                    ["capture", "delighter", *SCORES.values()],
                    [
                        [row.capture, row.delighter, *(number(row[key], 2) for key in SCORES)]
                        for row in proposed.rows.values()
                    ],
                ),
                f"""
        Most of the scan's face is in shadow, which makes its IoU an easy one. The stage takes {seconds.delit} s of one
        processor for sample and scan, {seconds.filmed_least} to {seconds.filmed_most} s where the sun is fitted to the
        texture. Occlusion is found where shape and texture agree; `shading` divides it out, so that little is left to
        find after it. The proposal has no measure yet on real people, whose shadows nobody has drawn.
        """,
            ),
        )
    ]
