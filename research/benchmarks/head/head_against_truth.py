# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the distance of a capture's head or scan to the true mesh in the facial skin, by cameras and after ICP.

    python -m research.benchmarks.head.head_against_truth CAPTURE TRUTH [MESH] [--surface head.obj|scan.ply]

TRUTH holds cameras.json ({"cameras": [{"frame", "matrix_world"}]}, Blender's convention) and face/NNNN.png. MESH is an
OBJ or PLY in that world, or a glTF in it turned Y up: (x, -z, y) of it is the world of cameras.json. Without MESH the
truth is the sample's subject.
"""

import json
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from core.capture.capture import Capture
from core.capture.frame_records import read_frames
from core.geometry import meshes, raster
from core.geometry.views import View, read_views
from core.imaging import images
from core.stages.registration.alignment import Similarity, similarity

from ...people.identities import subject_mesh
from ...people.sample import RESERVED
from ..figures import command_line


def compare_surface(capture: Capture, truth: Path, mesh: Path | None, surface: str = "head.obj") -> dict:
    """Measure the distance of a capture's surface to the true one, over the face's pixels.

    truth: folder with cameras and face/; mesh: the true surface, None: the sample's subject; surface: file of the
    capture, OBJ or PLY. Returns median, 90th and 95th percentile in mm, as placed by the cameras and after ICP.
    """
    pose, shared, theirs = pose_of_truth(capture, truth)
    frames = {name: frame.video_frame for name, frame in read_frames(capture).by_name.items()}
    ours = np.stack([v.centre for v in shared])

    points, normals = sample_truth(mesh)
    points, normals = pose.apply(points), normals @ pose.rotation.T
    ours_mesh = (
        meshes.read_obj(capture.root / surface) if surface.endswith(".obj") else meshes.read_ply(capture.root / surface)
    )
    hits = _face_points(ours_mesh, shared, frames, truth)
    tree = cKDTree(points)
    figures = {
        "camera_centres_mm": _round(1e3 * np.median(np.linalg.norm(pose.apply(theirs) - ours, axis=1))),
        "points": len(hits),
    }
    figures["by_cameras"] = _percentiles(_distances(hits, tree, points, normals))
    figures["after_icp"] = _percentiles(_distances(settle(hits, points, normals), tree, points, normals))
    return figures


def settle(hits: np.ndarray, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return points [N, 3] moved rigidly onto points [M, 3] with normals [M, 3] (ICP, point to plane)."""
    tree = cKDTree(points)
    for _ in range(20):
        index = tree.query(hits, workers=-1)[1]
        gap = ((hits - points[index]) * normals[index]).sum(1)
        hits = _moved(hits, points[index], normals[index], np.abs(gap) < 3 * np.median(np.abs(gap)))
    return hits


def pose_of_truth(capture: Capture, truth: Path) -> tuple[Similarity, list[View], np.ndarray]:
    """Return the similarity from TRUTH's world to the capture's, the shared views, and their true centres [N, 3]."""
    frames = {name: frame.video_frame for name, frame in read_frames(capture).by_name.items()}
    cameras = {
        c["frame"]: np.array(c["matrix_world"])[:3, 3]
        for c in json.loads((truth / "cameras.json").read_text())["cameras"]
    }
    shared = [v for v in read_views(capture) if frames[v.name] in cameras]
    ours, theirs = np.stack([v.centre for v in shared]), np.stack([cameras[frames[v.name]] for v in shared])
    return similarity(theirs, ours, np.ones(len(ours))), shared, theirs


def sample_truth(mesh: Path | None = None, count: int = 1_500_000) -> tuple[np.ndarray, np.ndarray]:
    """Return points and normals [count, 3] over the true surface, in the world of cameras.json."""
    if mesh is None:
        subject = subject_mesh(RESERVED["sample"])
        loaded = trimesh.Trimesh(subject.vertices, subject.faces, process=False)
    else:
        loaded = trimesh.load(mesh, force="mesh", process=False)
    points, face = trimesh.sample.sample_surface(loaded, count, seed=0)
    points, normals = np.asarray(points), np.asarray(loaded.face_normals[face])
    if mesh is not None and Path(mesh).suffix.lower() in (".glb", ".gltf"):
        points, normals = (x[:, [0, 2, 1]] * [1, -1, 1] for x in (points, normals))
    return points, normals


def _face_points(mesh: meshes.Mesh, views: list, frames: dict, truth: Path) -> np.ndarray:
    """Return the points [N, 3] of a surface at the pixels of the facial skin."""
    caster, hits = raster.RayCaster(mesh), []
    for view in views:
        path = truth / "face" / f"{frames[view.name]:04d}.png"
        if path.is_file():
            _, _, distance = raster.render_view(caster, view, 0.5)
            mask = images.resize(images.read_mask(path), *distance.shape[::-1]) > 0.5
            y, x = np.nonzero(mask & np.isfinite(distance))
            hits.append(view.centre + view.rays(np.stack([x, y], -1) * 2 + 1.0) * distance[y, x, None])
    return np.concatenate(hits)


def _distances(hits, tree, points, normals):
    distance, index = tree.query(hits, workers=-1)
    plane = np.abs(((hits - points[index]) * normals[index]).sum(1))
    return np.where(distance < 0.002, plane, distance)  # near: past the sampling of the surface


def _moved(hits, targets, normals, used):
    """One point-to-plane step of a rigid ICP."""
    middle = hits.mean(0)
    jacobian = np.concatenate([np.cross(hits - middle, normals), normals], 1)[used]
    turn = np.linalg.lstsq(jacobian, ((targets - hits) * normals).sum(1)[used], rcond=None)[0]
    return hits + np.cross(turn[:3], hits - middle) + turn[3:]


def _percentiles(distances: np.ndarray) -> dict:
    return {
        f"{name}_mm": _round(1e3 * np.percentile(distances, percent))
        for name, percent in (("median", 50), ("p90", 90), ("p95", 95))
    }


def _round(figure: float) -> float:
    return round(float(figure), 3)


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("capture", type=Path)
    parser.add_argument("truth", type=Path)
    parser.add_argument("mesh", type=Path, nargs="?")
    parser.add_argument("--surface", default="head.obj")
    args = parser.parse_args()
    print(json.dumps(compare_surface(Capture(args.capture), args.truth, args.mesh, args.surface), indent=1))


if __name__ == "__main__":
    main()
