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


def sections(engines: Figures) -> Sections:
    lamps, sky = engines.three_point, engines.overcast
    return [("", prose("""
        EEVEE's light over Cycles's, red, green, blue: the sample head in a real window, linear light, the same camera
        and maps, without denoising.
        """, table(engines), f"""
        Under lamps the two agree ({100 * (lamps.surface.red - 1):+.1f} % at most) as long as no light goes under the
        skin; under the overcast sky EEVEE is brighter, as it has less shadow from a sky. With light under the skin
        EEVEE gives back all of the Base Color and Cycles a little less: {100 * (lamps.random_walk_skin.blue - 1):.0f} %
        are left of that under lamps and {100 * (sky.random_walk_skin.blue - 1):.0f} % under a sky. By *Random Walk*, as
        0.1.0 had it, EEVEE was up to {100 * (lamps.random_walk.blue - 1):.0f} % brighter under lamps and
        {100 * (sky.random_walk.blue - 1):.0f} % under a sky. [What skin gives back of its albedo](even_light.md). Final
        pictures are Cycles's; EEVEE is for looking while you work.
        """))]
