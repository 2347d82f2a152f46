# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a capture's head misses points that were marked by hand in its photographs and never used by the fit.

    python -m benchmarks.face_marks CAPTURE [MARKS] [--held-out] [--json PATH]

MARKS: face_marks.json beside this file, of data/photographs: up to seventeen points per view, those that are seen and
well defined there; numbers, no likeness. A miss is told in percent of the face's width in that view: the distance of
the landmarks at the temples (234, 454) at the depth of the head. --held-out also fits the head again to the first three
photographs alone, and to all but each profile, and judges it in the others, whose cameras stay.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
from collections.abc import Collection
from pathlib import Path

import numpy as np
import pycolmap
import trimesh

from core import registration
from core.contract.capture import Capture
from core.contract.frame_records import read_frames
from core.contract.messages import Reporter
from core.contract.settings import Settings
from core.face import template
from core.geometry import meshes
from core.geometry.models import pose_of, read_model
from core.geometry.views import View, read_points, read_views

MARKS = Path(__file__).with_suffix(".json")
TEMPLES = (234, 454)
PROFILE_DEG = 70.0


def places(head: meshes.Mesh, points: dict[str, list[float]]) -> dict[str, np.ndarray]:
    """Where on a head [3] the points lie that are told on the built-in one at rest: on the nearest place of its nearest
    triangle."""
    rest, found = template.load(), {}
    for name, point in points.items():
        near = np.linalg.norm(rest.vertices - point, axis=1).argsort()[:3]
        faces = rest.faces[np.isin(rest.faces, near).any(1)]
        a, b, c = (rest.vertices[faces[:, i]] for i in range(3))
        points = np.tile(point, (len(faces), 1))
        bary = trimesh.triangles.points_to_barycentric(np.stack([a, b, c], 1), points, method="cramer")
        bary = np.clip(bary, 0, 1)
        bary /= bary.sum(1, keepdims=True)
        best = np.linalg.norm((rest.vertices[faces] * bary[..., None]).sum(1) - point, axis=1).argmin()
        found[name] = bary[best] @ head.vertices[faces[best]]
    return found


def misses(head: meshes.Mesh, views: dict[str, View], marks: dict) -> dict[str, dict[str, float]]:
    """view -> point -> miss in percent of the face's width; views by the name of their photograph."""
    at = places(head, marks["points"])
    temples = template.landmark_points(head)[list(TEMPLES)]
    found = {}
    for name, marked in marks["views"].items():
        if name not in views:
            continue
        view = views[name]
        pixels, depth = view.project(np.array([at[point] for point in marked]))
        width = np.linalg.norm(temples[1] - temples[0]) * view.camera.mean_focal_length() / np.median(depth)
        true = np.array(list(marked.values())) * [view.width / marks["width"], view.height / marks["height"]]
        found[name] = dict(zip(marked, (100 * np.linalg.norm(pixels - true, axis=1) / width).tolist(), strict=True))
    return found


def summary(errors_of_views: dict[str, dict[str, float]], names: Collection[str] | None = None) -> dict:
    """Over the views `names` (None: all): points, median, 90th percentile [% of the face's width], share under 3 %."""
    values = np.array(
        [
            value
            for name, points in errors_of_views.items()
            if names is None or name in names
            for value in points.values()
        ]
    )
    return {
        "points": len(values),
        "median_percent": round(float(np.median(values)), 2),
        "p90_percent": round(float(np.percentile(values, 90)), 2),
        "under_3_percent": round(100 * float((values < 3).mean()), 1),
    }


def by_photograph(capture: Capture) -> dict[str, View]:
    shown = {frame.name: frame.shown for frame in read_frames(capture).records}
    return {shown[view.name]: view for view in read_views(capture)}


def fitted_to(capture: Capture, names: Collection[str], folder: Path) -> meshes.Mesh:
    """The head of the capture's photographs `names` (as frames) alone, under the cameras that all have given; `folder`
    is filled."""
    part = Capture(folder)
    shutil.copytree(capture.frames, part.frames)
    model, whole = pycolmap.Reconstruction(), read_model(capture.cameras)
    for number in sorted(whole.cameras):
        model.add_camera_with_trivial_rig(pycolmap.Camera(whole.cameras[number].todict()))
    for number, image in sorted(whole.images.items()):
        if image.name in names:
            keypoints = np.array([p.xy for p in image.points2D]).reshape(-1, 2)
            kept = pycolmap.Image(name=image.name, camera_id=image.camera_id, image_id=number, keypoints=keypoints)
            model.add_image_with_trivial_frame(kept, pose_of(image))
    for point in whole.points3D.values():
        seen = [
            pycolmap.TrackElement(e.image_id, e.point2D_idx) for e in point.track.elements if e.image_id in model.images
        ]
        if len(seen) > 1:
            model.add_point3D(point.xyz, pycolmap.Track(seen), point.color)
    part.cameras.mkdir()
    model.write_binary(str(part.cameras))
    meshes.write_points(part.scan, read_points(part)[0])
    registration.run(part, Settings(), Reporter("registration"))
    return meshes.read_obj(part.head)


def held_out(capture: Capture, marks: dict) -> dict:
    """The figures of heads fitted to some photographs and judged in the others."""
    views, rows = by_photograph(capture), {}
    order = [name for name in marks["views"] if name in views]
    sides = [
        name
        for name in order
        if abs(np.degrees(np.arctan2(views[name].centre[0], -views[name].centre[1]))) > PROFILE_DEG
    ]
    plans = {"first three": order[3:]} | {f"without {name}": [name] for name in sides}
    for title, judged in plans.items():
        with tempfile.TemporaryDirectory() as folder:
            head = fitted_to(
                capture, [views[name].name for name in order if name not in judged], Path(folder) / "part.wildcap"
            )
        rows[title] = summary(misses(head, views, marks), judged)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("capture", type=Path)
    parser.add_argument("marks", type=Path, nargs="?", default=MARKS)
    parser.add_argument("--held-out", action="store_true")
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    capture, marks = Capture(args.capture), json.loads(args.marks.read_text(encoding="utf-8"))
    found = misses(meshes.read_obj(capture.head), by_photograph(capture), marks)
    figures = {"all": summary(found), "views": {name: summary(found, [name]) for name in found}}
    figures["points"] = {
        point: round(float(np.median([seen[point] for seen in found.values() if point in seen])), 2)
        for point in marks["points"]
        if any(point in seen for seen in found.values())
    }
    if args.held_out:
        figures["held_out"] = held_out(capture, marks)
    print(json.dumps(figures, indent=1))
    if args.json:
        args.json.write_text(json.dumps(figures, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
