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
    setup = """
        The subject is a real scan (CC BY, not part of this repository); 96 frames, path-traced.
        `python -m core run capture.mp4 CAPTURE --skin-tone ...`, then the commands above.
        """
    geometry_text = f"""
        Face coverage {albedo.face_coverage:.4f}. Cameras: {truth.registered:.0f} of {cameras.frames} frames, median
        centre error {truth.centre_error_median_percent:.3f} % of the camera distance, rotations
        {truth.rotation_error_median_deg:.2f} degrees, focal {truth.focal_px:.0f} px of {truth.true_focal_px:.0f}. Head
        against the true surface, in the face: median {head.median_mm:.2f} mm, 90 % {head.p90_mm:.2f} mm, 95 %
        {head.p95_mm:.2f} mm after the similarity of the camera centres; {icp.median_mm:.2f}, {icp.p90_mm:.2f} and
        {icp.p95_mm:.2f} mm after ICP.
        """
    care = """
        The pulls on the lights were chosen while looking at this scan, the sample and the six people: these tables show
        how well one setting served all eight, not a ninth. The scan's own map contains light: by this measure today's
        solver, which removes more of it, is worse; by the measures of [skin or light](split.md), which do not compare
        large shapes with the map, it is not. Most of the rest is the delighter's.
        """
    return [("", prose(setup, table(albedo), geometry_text, OLDER)), ("Read with care", prose(care))]
