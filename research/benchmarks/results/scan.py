# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/scan.md: the one real skin, a head scan under hard sun."""

from __future__ import annotations

from ..albedo_score import table
from ..figures import Figures, markdown
from ..pages import Sections, prose
from .split import OLDER

TITLE = "A head scan under hard sun through leaves"
SAYS = "The one real skin: albedo, cameras and head against the truth, and what the solve adds to each delighter."
RECORDS = ("scan_albedo", "whole_chain", "geometry")


def sections(albedo: Figures, chain: Figures, geometry: Figures) -> Sections:
    cameras, truth, rows = geometry.lps_sun.cameras, geometry.lps_sun.cameras.against_truth, chain.rows
    head, icp = geometry.lps_sun.head.against_truth.by_cameras, geometry.lps_sun.head.against_truth.after_icp
    lost = rows["scan, network"].solve_off.psnr - rows["scan, network"].solved.psnr
    proposed = rows["scan, network"].true_mask.psnr - rows["scan, network"].solved.psnr
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
            "What the solve adds",
            prose(
                """
        *Solve off* is the texture at the true tone, taken for the albedo; raw PSNR and SSIM.
        """,
                markdown(
                    ["capture", "delighter", "solve off", "solved", "solved with the true shadow as mask"],
                    [
                        [
                            row.capture,
                            row.delighter,
                            *(quality(row[key]) for key in ("solve_off", "solved", "true_mask")),
                        ]
                        for row in rows.values()
                    ],
                ),
                f"""
        The proposed mask costs {proposed:.2f} dB on the scan against the true one (intersection over union on the scan
        {chain.mask_iou.scan:.2f}, on the sample {chain.mask_iou.sample:.2f}). The solve gains
        {rows["scan, none"].solved.psnr - rows["scan, none"].solve_off.psnr:.1f} dB on raw frames and
        {rows["sample, network"].solved.psnr - rows["sample, network"].solve_off.psnr:.1f} dB on the sample, and **loses
        {lost:.1f} dB on the scan**: there it takes a part of the beard and the cheeks for light.
        """,
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


def quality(record: Figures) -> str | None:
    return None if record.psnr is None else f"{record.psnr:.2f} dB, {record.ssim:.3f}"
