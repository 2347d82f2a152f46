# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/geometry.md: cameras, scan, head and texture against the truth."""

from ..figures import Figures
from ..head.geometry import table
from ..pages import prose

TITLE = "Geometry and texture"
SAYS = "Cameras, scan, head and texture of the sample, the head scan and a bust, against the truth."
RECORDS = ("geometry",)


def sections(geometry: Figures) -> str:
    truth, head = geometry.lps_sun.cameras.against_truth, geometry.lps_sun.head.against_truth
    return prose(
        "![frame, scan, wireframe and texture of the synthetic sample](../pictures/geometry.jpg)",
        table(geometry),
        f"""
        The machine was shared with other work: the seconds are upper bounds, and older than [the costs](costs.md).

        **Scale** comes from the whole head fitted to the landmarks. **The focal length is too short** on the scan
        ({truth.focal_px:.0f} px of {truth.true_focal_px:.0f}), which makes a quarter of the head's distance to the
        truth: {head.by_cameras.median_mm:.2f} mm by the cameras, {head.after_icp.median_mm:.2f} mm after ICP. **The
        scan has holes** where a nose or an ear is in hard light from one side only; the head bridges them, the
        delivered raw scan shows them.
        """,
    )
