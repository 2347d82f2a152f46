# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/engines.md: Cycles and EEVEE on the same skin."""

from __future__ import annotations

from ..engines import table
from ..figures import Figures
from ..pages import Sections, prose

TITLE = "Cycles and EEVEE on the lit cheek"
SAYS = "How far the two agree, with and without light under the skin."
RECORDS = ("engines",)


LAMPS, SKY = ("three_point", "sun"), ("overcast",)


def sections(engines: Figures) -> Sections:
    def off(lights: tuple[str, ...], skin: str) -> float:
        """Percent by which EEVEE differs there, in the colour and light in which it does most."""
        return max((100 * (ratio - 1) for light in lights for ratio in engines[light][skin].values()), key=abs)

    return [
        (
            "",
            prose(
                """
        EEVEE's light over Cycles's, red, green, blue: the sample head in a real window, linear light, the same camera
        and maps, without denoising.
        """,
                table(engines),
                f"""
        Under lamps the two agree ({off(LAMPS, "surface"):+.1f} % at most) as long as no light goes under the skin;
        under the overcast sky EEVEE is brighter, as it has less shadow from a sky. With light under the skin EEVEE
        gives back all of the Base Color and Cycles a little less: {off(LAMPS, "random_walk_skin"):.0f} % are left of
        that under lamps and {off(SKY, "random_walk_skin"):.0f} % under a sky. By *Random Walk*, as 0.1.0 had it, EEVEE
        was up to {off(LAMPS, "random_walk"):.0f} % brighter under lamps and {off(SKY, "random_walk"):.0f} % under a
        sky. [What skin gives back of its albedo](even_light.md). Final pictures are Cycles's; EEVEE is for looking
        while you work.
        """,
            ),
        )
    ]
