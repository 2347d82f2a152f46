# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scan: frames and cameras become scan.ply, the dense surface of the head as far as it was seen.

Pairs of frames are matched by semi-global stereo, coarse to fine, and their depth maps fused in a truncated signed
distance field; with an NVIDIA GPU and gsplat, Gaussian surfels trained on the frames refine that surface, and their
depth is fused the same way.
"""

import time

import numpy as np

from ...capture.capture import Capture
from ...capture.files import remove_file
from ...capture.frame_records import read_frames
from ...capture.messages import Reporter
from ...geometry import meshes, raster
from ...geometry.views import View, read_points, read_views
from ...imaging import images
from ...settings.settings import Settings
from . import rounds, splats

HEAD_BOX_M = np.array([[-0.13, -0.08, -0.21], [0.13, 0.21, 0.19]])
"""Box of a head in its world: the origin is midway between the eyes, the face looks along -Y."""
MOST_DISAGREEING_SHARE = 0.03  # maximum share of the surface for hair and highlights; more is a subject that moved


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Write capture.scan: a surface, or the points that match between frames if no pair of them gives one."""
    started = time.monotonic()
    views = read_views(capture)
    frames = read_frames(capture).by_name
    sharpness = np.array([frames[view.name].sharpness for view in views])
    by_splats = splats.use_splats(settings.scan.method, settings.compute_device)
    fused, maps = rounds.measure(
        views, sharpness, settings.scan.pairs, settings.scan.voxel_mm / 1000, HEAD_BOX_M, report
    )
    if fused is not None and by_splats:
        fused, maps = splats.measure(
            fused.mesh, views, settings.scan.voxel_mm / 1000, HEAD_BOX_M, settings.compute_device, report
        )
    if fused is None or len(fused.mesh.faces) < 1000:
        _without_surface(capture, report)
        report.figure("seconds", round(time.monotonic() - started, 1))
        return
    mesh = fused.mesh
    meshes.write_ply(capture.scan, mesh)
    report.figure("method", "splats" if by_splats else "stereo")
    report.figure("depth_maps", len(maps))
    report.figure("points", len(mesh.vertices))
    report.figure("faces", len(mesh.faces))
    report.figure("disagreeing_percent", round(100 * fused.disagreeing, 2))
    report.figure("floating_percent", round(100 * fused.floating, 2))
    if not by_splats:
        disagreement = np.nanmedian([depth_map.disagreement for depth_map in maps])
        report.figure("left_right_disagreement_px", round(float(disagreement), 3))
    report.figure("seconds", round(time.monotonic() - started, 1))
    if fused.disagreeing > MOST_DISAGREEING_SHARE:
        report.finding(
            f"The frames disagree about {100 * fused.disagreeing:.0f} % of the surface; it was left out of the scan.",
            "Film again with the head kept still, the hair tied back and nothing shiny on the skin.",
        )
    images.write_srgb(capture.picture("scan", "surface"), _draw(mesh, views))


def _without_surface(capture: Capture, report: Reporter) -> None:
    points = read_points(capture)[0]
    points = points[((points > HEAD_BOX_M[0]) & (points < HEAD_BOX_M[1])).all(1)]
    meshes.write_points(capture.scan, points)
    remove_file(capture.picture("scan", "surface"))
    report.figure("method", "none")
    report.figure("points", len(points))
    report.finding(
        "No surface of the head could be measured from these frames. "
        "The head is fitted to facial features, outlines and matched points only.",
        "For a closer likeness, take sharper pictures every ten degrees around the face, in good light.",
    )


def _draw(mesh: meshes.Mesh, views: list[View], height: int = 480) -> np.ndarray:
    """Draw the shaded scan from the first, the middle and the last camera around the head, side by side."""
    caster, normals = raster.RayCaster(mesh), meshes.vertex_normals(mesh)
    around = sorted(views, key=lambda view: np.arctan2(view.centre[0], -view.centre[1]))
    shots = []
    for view in (around[0], around[len(around) // 2], around[-1]):
        face, bary, _ = raster.render_view(caster, view, height / view.height)
        normal = raster.interpolate(normals, mesh.faces, face, bary)
        light = np.clip(0.15 + 0.85 * np.maximum(normal @ -view.axis, 0), 0, 1)
        shots.append(np.where((face >= 0)[..., None], light[..., None] * [0.85, 0.8, 0.75], 1.0))
    return np.concatenate(shots, 1)
