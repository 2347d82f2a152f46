# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/rerender.md: face reconstruction, as in the paper's Table 1."""

from ..figures import Figures
from ..maps.rerender import table
from ..pages import prose

TITLE = "Face reconstruction, as in the paper's Table 1"
SAYS = "Albedo times shading against its own frames: a tie between all light models."
RECORDS = ("rerender",)


def sections(rerender: Figures) -> str:
    ahead = rerender.mean["environment, no prior"].psnr - rerender.mean.wildcap.psnr
    return prose(
        """
        Albedo times shading of the delit rows of [the comparison](comparison.md), in the sixteen views of the texture,
        against their delit frames, on facial skin seen from less than 72 degrees to the side; one gain per channel and
        view for all rows. *The texture itself* shows how far the views agree with each other.
        """,
        table(rerender),
        f"""
        **A tie, not a first place**: every row reaches the goal (28.8 dB, SSIM 0.95). Sampling under guidance explains
        the texture under any light model, and the rest is where the views differ. Texels that follow the frames alone
        explain them best ({ahead:+.1f} dB), baked shadows included. Our figure is above the paper's because its
        captures are real, while this set's cameras and heads are nearly the true ones.
        """,
    )
