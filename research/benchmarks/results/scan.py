# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/scan.md: the one real skin, a head scan under hard sun."""

from ..figures import Figures
from ..maps.albedo_score import table
from ..pages import Sections, prose
from .split import OLDER

TITLE = "A head scan under hard sun through leaves"
SAYS = "The one real skin: albedo, cameras and head against the truth."
RECORDS = ("scan_albedo", "geometry")


def sections(albedo: Figures, geometry: Figures) -> Sections:
    cameras, truth = geometry.lps_sun.cameras, geometry.lps_sun.cameras.against_truth
    head, icp = geometry.lps_sun.head.against_truth.by_cameras, geometry.lps_sun.head.against_truth.after_icp
    return [
        (
            "",
            prose(
                """
        The subject is a real scan (CC BY, not part of this repository); 96 frames, path-traced.
        `python -m core run capture.mp4 CAPTURE --skin-tone ...`, then the commands above.
        """,
                table(albedo),
                f"""
        Face coverage {albedo.face_coverage:.4f}. Cameras: {truth.registered:.0f} of {cameras.frames} frames, median
        centre error {truth.centre_error_median_percent:.3f} % of the camera distance, rotations
        {truth.rotation_error_median_deg:.2f} degrees, focal {truth.focal_px:.0f} px of {truth.true_focal_px:.0f}. Head
        against the true surface, in the face: median {head.median_mm:.2f} mm, 90 % {head.p90_mm:.2f} mm, 95 %
        {head.p95_mm:.2f} mm after the similarity of the camera centres; {icp.median_mm:.2f}, {icp.p90_mm:.2f} and
        {icp.p95_mm:.2f} mm after ICP.
        """,
                OLDER,
            ),
        ),
        (
            "Read with care",
            prose("""
        How far the lights were held back had been chosen while looking at this scan, the sample and the six people:
        these tables say how well one setting served all eight, not what a ninth would get. And the scan's own map holds
        light: by this measure the solver as it is, which takes more of it away, is worse, and by those of [skin or
        light](split.md), which do not ask the map for its large shapes, it is not. What remains is mostly the
        delighter's.
        """),
        ),
    ]
