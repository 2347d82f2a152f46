# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/shadows.md: the mask that is proposed, and a shadow that is masked exactly."""

from __future__ import annotations

from .. import shadow_steps
from ..figures import Figures, markdown
from ..pages import Sections, prose

TITLE = "Shadow masks"
SAYS = (
    "The proposed mask against the true shadow, what a shadow that is masked exactly leaves in the albedo, and "
    "how much of a step along a mask's border is light."
)
RECORDS = ("shadow_mask", "painted_shadow", "shadow_steps")
SCORES = {
    "true": "true",
    "masked": "masked",
    "iou": "IoU",
    "precision": "precision",
    "recall": "recall",
    "border_f": "border F",
}


def sections(proposed: Figures, painted: Figures, steps: Figures) -> Sections:
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
                        [
                            row.capture,
                            row.delighter,
                            *(None if row[key] is None else f"{row[key]:.2f}" for key in SCORES),
                        ]
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
        ),
        (
            "A shadow that is masked exactly",
            prose(
                """
        A disc on the sample head's cheek is darkened in its texture and solved at 512: the share of the darkening that
        stays in the albedo.
        """,
                markdown(
                    ["light in the shadow", "mask", "left of the shadow in the albedo"],
                    [[f"{row.light:.1f}", row.mask, f"{100 * row.left:.0f} %"] for row in painted.rows.values()],
                ),
                """
        After a delighter local light is held to what the shadow's own border says is missing
        (`core/solver/extensions/border.py`),
        for a proposal takes dark skin and beards along. What the artist adds to the proposal is taken at its word.
        """,
            ),
        ),
        (
            "Steps along a mask's border",
            prose(
                """
        Inside of M less outside, natural log, mean ± deviation along its border: what the delighter took out; what the
        solver sees, its texture over the mean face in its light; and what is left of the light in truth. The last
        differs by much the same on every capture, whatever is seen: what is seen beyond it is skin's own (a beard
        along whose edge the mask runs). So the solver takes LEFT^2 over the variance of what it sees for light. *Taken
        for light*: that share, with LEFT from other people alone; *best*: the slope of the true steps on those
        that are seen.
        """,
                shadow_steps.table(steps.rows),
            ),
        ),
    ]
