# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From structure from motion's arbitrary world to the head's: metres, +Z up, face towards -Y, origin midway between the eyes.

Face landmarks of several frames are intersected as rays; the corners of the eyes give scale and left-right, brow and chin give up.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pycolmap

from .. import faces, images
from ..messages import Problem, Reporter

MOST_FRAMES = 24
FRONTAL_DEG = 45.0
"""Landmarks slide along the silhouette of a turned head, so frames within this yaw are taken where there are enough."""
MOVED = 0.08
"""Share of the face's width by which the landmarks' rays may miss each other in a quarter of the frames before the head counts as moved."""


@dataclass(frozen=True)
class HeadFrame:
    """The similarity into the head's world, and how well the landmarks' rays meet [px, median over frames and landmarks]."""

    world_from_model: pycolmap.Sim3d
    error_px: float
    frames: int


def find_head(model: pycolmap.Reconstruction, records: list[dict], folder: Path, interpupillary_m: float, report: Reporter) -> HeadFrame:
    """Raises Problem where fewer than two registered frames show a face, or where its rays do not meet (the head moved on its own)."""
    seen = _registered_with_face(model, records)
    if len(seen) < 2:
        raise Problem("The face is seen in fewer than two of the frames whose cameras were found.",
                      "Film so that eyes, nose and mouth stay visible in most of the frames.")
    origins, directions, focal, widths = [], [], [], []
    for done, (image, record) in enumerate(seen):
        report.progress(done, len(seen), "finding the face in the cameras")
        face = faces.detect(images.read_srgb(folder / record["name"]))
        if face is None:
            continue
        pose = image.cam_from_world() if callable(image.cam_from_world) else image.cam_from_world
        rotation, camera = pose.rotation.matrix(), model.cameras[image.camera_id]
        plane = np.asarray(camera.cam_from_img(face.landmarks[:, :2].astype(np.float64)))
        rays = np.concatenate([plane, np.ones((len(plane), 1))], 1) @ rotation
        directions.append(rays / np.linalg.norm(rays, axis=1, keepdims=True))
        origins.append(-rotation.T @ np.asarray(pose.translation))
        focal.append(camera.mean_focal_length())
        widths.append(face.box[2] - face.box[0])
    if len(origins) < 2:
        raise Problem("The face could not be found again in two frames.", "Film so that eyes, nose and mouth stay visible in most of the frames.")
    points, angles = intersect_rays(np.array(origins), np.array(directions))
    errors = np.median(angles * np.array(focal)[:, None], axis=1)  # per frame, so that a head that sat elsewhere in a quarter of them shows
    if np.percentile(errors, 75) > MOVED * np.median(widths):
        raise Problem("The face is not still with respect to its surroundings: the cameras follow the background, and the head moved.",
                      "Let the person sit still, look at one point, and move the camera instead.")
    return HeadFrame(_similarity(points, interpupillary_m), float(np.median(errors)), len(origins))


def intersect_rays(origins: np.ndarray, directions: np.ndarray, rounds: int = 10) -> tuple[np.ndarray, np.ndarray]:
    """The points [P, 3] nearest to rays from origins [N, 3] along unit directions [N, P, 3], robustly (L1 by reweighting);
    and the angles [N, P] in radians by which the rays miss them."""
    across = np.eye(3) - directions[..., :, None] * directions[..., None, :]  # [N, P, 3, 3], projects off the ray
    weights = np.ones(directions.shape[:2])
    for _ in range(rounds):
        a = (weights[..., None, None] * across).sum(0)
        b = (weights[..., None, None] * across @ origins[:, None, :, None]).sum(0)
        points = np.linalg.solve(a + 1e-12 * np.eye(3), b)[..., 0]
        offset = points[None] - origins[:, None]
        distance = np.linalg.norm(offset, axis=-1)
        miss = np.linalg.norm((across @ offset[..., None])[..., 0], axis=-1)
        angle = miss / distance
        weights = 1 / (distance**2 * np.maximum(angle, 1e-3))
    return points, angle


def _registered_with_face(model: pycolmap.Reconstruction, records: list[dict]) -> list[tuple]:
    """Registered images with their records: those that face the camera most, spread over the sequence."""
    by_name = {record["name"]: record for record in records}
    seen = [(image, by_name[image.name]) for image in model.images.values() if image.has_pose and by_name.get(image.name, {}).get("yaw_deg") is not None]
    seen.sort(key=lambda pair: pair[0].name)
    frontal = [pair for pair in seen if abs(pair[1]["yaw_deg"]) < FRONTAL_DEG]
    if len(frontal) >= 4:
        seen = frontal
    return [seen[i] for i in np.unique(np.linspace(0, len(seen) - 1, min(MOST_FRAMES, len(seen))).round().astype(int))] if seen else []


def _similarity(points: np.ndarray, interpupillary_m: float) -> pycolmap.Sim3d:
    """Landmarks [468, 3] -> the similarity that puts the eyes' middle at the origin, the person's left at +X, up at +Z."""
    right, left = points[list(faces.RIGHT_EYE)].mean(0), points[list(faces.LEFT_EYE)].mean(0)
    x = left - right
    scale = interpupillary_m / np.linalg.norm(x)
    x /= np.linalg.norm(x)
    up = points[faces.BROW] - points[faces.CHIN]
    z = up - x * (up @ x)
    z /= np.linalg.norm(z)
    rotation = np.stack([x, np.cross(z, x), z])  # rows: the new axes in the old world
    return pycolmap.Sim3d(scale, pycolmap.Rotation3d(rotation), -scale * rotation @ ((left + right) / 2))
