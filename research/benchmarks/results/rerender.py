# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/rerender.md: face reconstruction, as in the paper's Table 1."""

from ..figures import Figures
from ..maps.rerender import table
from ..pages import Sections, prose

TITLE = "Face reconstruction, as in the paper's Table 1"
SAYS = "Albedo times shading against the frames it came from: a tie, which tells no light models apart."
RECORDS = ("rerender",)


def sections(rerender: Figures) -> Sections:
    ahead = rerender.mean["environment, no prior"].psnr - rerender.mean.wildcap.psnr
    return [
        (
            "",
            prose(
                """
        Albedo times shading of the delit rows of [the comparison](comparison.md), in the sixteen views that the texture
        came from, against their delit frames, on facial skin seen from less than 72 degrees to the side; one gain per
        channel and view for all rows. *The texture itself* says how far the views agree with each other.
        """,
                table(rerender),
                f"""
        **A tie, not a first place**: what is asked for (28.8 dB, SSIM 0.95) is reached by every row. Sampling under
        guidance explains the texture whatever the light model, and what is left is where the views differ; texels that
        follow the frames alone explain them best ({ahead:+.1f} dB), baked shadows and all. Our figure lies above the
        paper's because its captures are real, and this set's cameras and heads are nearly the true ones.
        """,
            ),
        )
    ]
