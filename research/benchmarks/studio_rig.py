# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A studio through the chain up to the mask: `python -m research.benchmarks.studio_rig FOLDER [--seed N] [--scale S]`.

Sixteen fixed, calibrated cameras under even light, in the layout of multi-view studios, photograph a synthetic person;
their calibration comes in as Blender's cameras. FOLDER gets the photographs, rig.json and the capture; printed are the
figures of cameras, head and mask.
"""

from __future__ import annotations

import argparse
import json
from importlib import import_module
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.geometry import meshes
from core.geometry.views import read_views
from core.imaging import images
from core.settings.settings import from_json

from ..people import painted_head
from .cameras_against_truth import similarity

STAGES = ("frames", "cameras", "scan", "registration", "delight", "texture", "shadow_mask")


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m research.benchmarks.studio_rig", description=__doc__.splitlines()[0]
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=painted_head.SEED)
    parser.add_argument("--scale", type=float, default=2.4, help="of the pictures; 1 is 300 x 400")
    asked = parser.parse_args()
    views = painted_head.studio(asked.scale)
    photograph(views, asked.folder, asked.seed)
    capture = Capture(asked.folder / "face.wildcap")
    capture.root.mkdir(parents=True, exist_ok=True)
    capture.set_source(asked.folder / "photos")
    settings = from_json({"cameras": {"import_from": str(asked.folder / "rig.json")}, "delight": {"delighter": "none"}})
    for stage in STAGES:
        report = Reporter(stage)
        import_module(f"core.stages.{stage}").run(capture, settings, report)
        print(stage, json.dumps(report.figures))
        for finding in report.findings:
            print("  finding:", finding["problem"])
    print(json.dumps(judge(capture, views, asked.seed)))


def photograph(views: list, folder: Path, seed: int) -> None:
    """folder/photos/cam_NN.png and folder/rig.json."""
    cameras = []
    for i, view in enumerate(views):
        images.write_srgb(
            folder / "photos" / f"cam_{i:02d}.png",
            painted_head.photograph(view, wall=False, even=True, seed=seed, texels=2048),
        )
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = view.rotation.T @ np.diag([1, -1, -1]), view.centre
        cameras.append({"name": f"cam_{i:02d}", "matrix_world": matrix.tolist()})
    camera = views[0].camera
    rig = {"width": camera.width, "height": camera.height, "focal_px": camera.mean_focal_length(), "cameras": cameras}
    (folder / "rig.json").write_text(json.dumps(rig))


def judge(capture: Capture, views: list, seed: int) -> dict:
    """Head against the true one in the cameras' true world, and how much of the texture the mask covers."""
    from scipy.spatial import cKDTree

    found = read_views(capture)
    scale, rotation, shift = similarity(
        np.array([view.centre for view in found]), np.array([view.centre for view in views])
    )
    true = painted_head.person(seed, 2048)[0].mesh
    head = scale * meshes.read_obj(capture.head).vertices @ rotation.T + shift
    x, y, z = true.vertices.T
    face = (y < 0.0) & (np.abs(x) < 0.06) & (z > -0.12) & (z < 0.05)
    off = 1000 * cKDTree(head).query(true.vertices[face])[0]
    return {
        "metres_per_metre": round(scale, 4),
        "face_to_nearest_vertex_median_mm": round(float(np.median(off)), 2),
        "face_to_nearest_vertex_p90_mm": round(float(np.percentile(off, 90)), 2),
        "mask_percent_of_texture": round(100 * float(images.read_mask(capture.shadow_mask_auto).mean()), 3),
    }


if __name__ == "__main__":
    main()
