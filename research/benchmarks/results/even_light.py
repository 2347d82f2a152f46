# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/even_light.md: the albedo that skin gives back in Cycles."""

from ..figures import Figures
from ..light.even_light import table
from ..pages import prose

TITLE = "What skin gives back of its albedo"
SAYS = "Cycles's two random walks, and the material that makes up for the loss."
RECORDS = ("even_light",)


def sections(record: Figures) -> str:
    return prose(
        """
        Red, green and blue light from the middle of a sphere as large as a head over its albedo, in Cycles, under even
        light from everywhere and without gloss; 1 is all of it. *Random walk*: Cycles's method of that name, with the
        albedo as the Base Color, as in the material of 0.1.0. *Random walk (skin)*: the other method. *WildCap Skin*:
        today's material, which multiplies the albedo by the mean loss of the second method over the tones, in
        proportion to *Subsurface*; the map itself stays as measured.
        """,
        table(record),
    )
