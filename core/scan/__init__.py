# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stage scan: frames and cameras become scan.ply, the dense surface of the head as far as it was seen.

Pairs of frames are matched by semi-global stereo, and their depth maps fused in a truncated signed distance field.
"""

from __future__ import annotations

import json
import time

import cv2
import numpy as np

from .. import faces, images, meshes, raster
from ..capture import Capture
from ..messages import Problem, Reporter
from ..settings import Settings
from ..views import View, read_views
from .fusion import fuse
from .pairs import choose_pairs
from .stereo import match_pair

HEAD_BOX = np.array([[-0.13, -0.08, -0.21], [0.13, 0.21, 0.19]])
"""Where a head lies in its world, in metres: the origin is midway between the eyes, the face looks along -Y."""
HEAD_WIDTH_M, HEAD_WIDTH_PX = 0.15, 310
"""A head is matched at about this width in pixels: finer pictures cost time without gain; nothing is enlarged."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Writes capture.scan. Raises Problem where no pair of frames gives a surface."""
    started = time.monotonic()
    views = read_views(capture)
    sharpness = _sharpness(capture, views)
    pairs = choose_pairs(np.array([view.centre for view in views]), sharpness, settings.scan.pairs)
    steps = 2 * len(pairs)
    pictures, maps = {}, []
    for done, pair in enumerate(sorted(pairs)):
        report.progress(done, steps, f"matching pair {done + 1} of {len(pairs)}")
        for i in set(pictures) - set(pair):  # neighbours in order share pictures; more would fill the memory
            del pictures[i]
        for i in pair:
            pictures.setdefault(i, _picture_and_mask(views[i]))
        scale = _scale(views[pair[0]])
        seen = match_pair(views[pair[0]], views[pair[1]], tuple(pictures[i][0] for i in pair), tuple(pictures[i][1] for i in pair), HEAD_BOX, scale)
        if seen is not None:
            maps.append(seen)
    mesh = fuse(maps, HEAD_BOX, settings.scan.voxel_mm / 1000, lambda done: report.progress(len(pairs) + done, steps, "fusing depth")) if maps else None
    if mesh is None or len(mesh.faces) < 1000:
        raise Problem("No surface of the head could be measured from these frames.",
                      "Use sharper frames that lie closer together: walk slowly, in good light, and keep the face in the picture.")
    meshes.write_ply(capture.scan, mesh)
    report.figure("pairs", len(maps))
    report.figure("points", len(mesh.vertices))
    report.figure("faces", len(mesh.faces))
    report.figure("left_right_disagreement_px", round(float(np.nanmedian([seen.disagreement for seen in maps])), 3))
    report.figure("seconds", round(time.monotonic() - started, 1))
    images.write_srgb(capture.picture("scan", "surface"), _draw(mesh, views))


def _sharpness(capture: Capture, views: list[View]) -> np.ndarray:
    by_name = {f["name"]: f["sharpness"] for f in json.loads(capture.frames_json.read_text(encoding="utf-8"))["frames"]}
    return np.array([by_name[view.name] for view in views])


def _scale(view: View) -> float:
    width = view.camera.mean_focal_length() * HEAD_WIDTH_M / np.linalg.norm(view.centre)
    return float(np.clip(HEAD_WIDTH_PX / width, 0.25, 1.0))


def _picture_and_mask(view: View) -> tuple[np.ndarray, np.ndarray]:
    """A view's frame, and where it shows a person, grown by a few pixels."""
    picture = images.read_srgb(view.path)
    mask = (faces.segment_person(picture) > 0.3).astype(np.uint8)
    return picture, cv2.dilate(mask, np.ones((9, 9), np.uint8)) > 0


def _draw(mesh: meshes.Mesh, views: list[View], height: int = 480) -> np.ndarray:
    """The shaded scan from the first, the middle and the last camera around the head, side by side."""
    caster, normals = raster.RayCaster(mesh), meshes.vertex_normals(mesh)
    around = sorted(views, key=lambda view: np.arctan2(view.centre[0], -view.centre[1]))
    shots = []
    for view in (around[0], around[len(around) // 2], around[-1]):
        face, bary, _ = raster.render_view(caster, view, height / view.height)
        normal = raster.interpolate(normals, mesh.faces, face, bary)
        light = np.clip(0.15 + 0.85 * np.maximum(normal @ -view.axis, 0), 0, 1)
        shots.append(np.where((face >= 0)[..., None], light[..., None] * [0.85, 0.8, 0.75], 1.0))
    return np.concatenate(shots, 1)
