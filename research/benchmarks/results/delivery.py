# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/delivery.md: other meshes, and the delivery."""

from ..figures import Figures, markdown
from ..pages import prose

TITLE = "Other meshes, and the delivery"
SAYS = "The fit of your own mesh, skins carried to our UVs, and the scan's atlas."
RECORDS = ("own_mesh", "carried_skins", "atlas")


def sections(own: Figures, carried: Figures, atlas: Figures) -> str:
    rows = [[name, row.shapes, f"{row.median_mm:.2f} mm", f"{row.p95_mm:.2f} mm"] for name, row in own.rows.items()]
    return prose(
        """
        Your own mesh on the sample's head: median and 95th percentile of its drawn skin's distance to the built-in
        head. No mesh has a flipped triangle.
        """,
        markdown(["mesh", "shapes", "median", "95 %"], rows),
        f"""
        This is the distance between surfaces, not between matching places. For a mesh whose answer is known (the
        built-in head, coarser, in centimetres, Y up) `tests/core/stages/registration/test_own_template.py` keeps the
        vertices of the face within 1 mm of their place (median; 95 %: 2 mm). Lids stay as your mesh has them: open eyes
        stay open over the head's closed ones. Teeth can show between lips that only touch. Ears follow the shape around
        them, not their folds. Mouth, sockets and what lies below the neck continue the skin smoothly; the confidence
        map is black there.

        The {carried.skins} VALID skins in our UVs: {100 * carried.counterpart:.1f} % of the map has a counterpart, and
        the head lies {carried.median_mm:.2f} mm from ours (95 %: {carried.p95_mm:.2f} mm).

        The scan's atlas (xatlas) on the sample covers {100 * atlas.covered:.0f} % of its square, with a stretch of
        {atlas.stretch_p95:.2f} (95th percentile; 1 is none), in {atlas.seconds} s of the stage Delivery on two busy
        cores. The scan's albedo beyond the head's reach (hair, clothes) is the filmed colour times one gain, so sunlit
        cloth is too bright; `scan_albedo_known.png` shows where.
        """,
    )
