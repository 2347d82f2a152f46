# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From any world of cameras to the head's: metres, +Z up, face towards -Y, origin midway between the eyes.

Face landmarks of several frames are rays; the template's head laid against them gives upright and, by its pupils,
scale.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pycolmap

from ...capture.messages import Problem
from ...face import faces
from ...face.landmark_model import template_landmarks
from .landmarks import fit_rays, pupils

ASTRAY_RATIO, ASTRAY_WIDTH_SHARE = 4.0, 0.1
"""A frame whose landmarks miss those of the others by so many times the usual, and by such a share of the face's width,
shows a face that the net did not find: a profile, mostly."""
SURE_SCORE = 0.8
"""Score of a face that was found; the net gives one that is there 0.95 and more."""
FRONTAL_DEG = 45.0
"""Landmarks slide along the silhouette of a turned head, so frames within this yaw are taken where there are enough."""
PUPILS_M = 0.063
"""How far apart the template's pupils are."""
MOVED_WIDTH_SHARE = 0.08
"""Share of the face's width by which the landmarks' rays may miss each other in a quarter of the frames before the head
counts as moved."""


@dataclass(frozen=True)
class HeadFrame:
    """The similarity into the head's world; by how much the landmarks' rays miss each other [px, median over frames and
    landmarks], and that as a share of the face's width in the quarter of the frames where it is most; the distance of
    the pupils in the units of the cameras' own world; by how much the template's head misses the rays [m, median]."""

    world_from_model: pycolmap.Sim3d
    error_px: float
    miss: float
    pupils_apart: float
    unlike_m: float

    @property
    def template_from_model(self) -> pycolmap.Sim3d:
        """The similarity into the template's own world, as the head's but with pupils PUPILS_M apart."""
        into = self.world_from_model
        size = PUPILS_M / (into.scale * self.pupils_apart)
        return pycolmap.Sim3d(size * into.scale, into.rotation, size * into.translation)

    @property
    def still(self) -> bool:
        """Whether the head kept still with respect to what the cameras were found from."""
        return self.miss <= MOVED_WIDTH_SHARE


def find_head(
    model: pycolmap.Reconstruction, face_by_name: dict[str, faces.Face], interpupillary_m: float
) -> HeadFrame:
    """`face_by_name`: name -> face. Raises Problem where fewer than two registered frames show a face."""
    seen = _registered_with_face(model, face_by_name)
    if len(seen) < 2:
        raise Problem(
            "The face is seen in fewer than two of the frames whose cameras were found.",
            "Film so that eyes, nose and mouth stay visible in most of the frames.",
        )
    origins, directions = zip(*(rays(image, model.cameras[image.camera_id], face) for image, face in seen), strict=True)
    origins, directions = np.array(origins), np.array(directions)
    points, angles = intersect_rays(origins, directions)
    focal = np.array([model.cameras[image.camera_id].mean_focal_length() for image, _ in seen])
    width = np.median([face.box[2] - face.box[0] for _, face in seen])
    # per frame, so that a head that sat elsewhere in a quarter of them shows
    errors = np.median(angles * focal[:, None], axis=1)
    good = _together(errors, width)
    if not good.all():
        origins, directions = origins[good], directions[good]
        points, _ = intersect_rays(origins, directions)
    scale, rotation, translation, coefficients = fit_rays(origins, directions, points)
    right, left = pupils(coefficients)
    apart = scale * float(np.linalg.norm(left - right))
    size = interpupillary_m / apart
    middle = scale * rotation @ ((left + right) / 2) + translation
    similarity = pycolmap.Sim3d(size, pycolmap.Rotation3d(rotation.T), -size * rotation.T @ middle)
    head = scale * template_landmarks().shape(coefficients) @ rotation.T + translation
    offset = head[None] - origins[:, None]
    miss = np.linalg.norm(np.cross(offset, directions), axis=-1)[:, template_landmarks().trust > 0.2]
    return HeadFrame(
        similarity,
        float(np.median(errors)),
        float(np.percentile(errors, 75) / width),
        apart,
        float(np.median(miss)) * size,
    )


def head_of_one(coefficients: np.ndarray, error_px: float, miss: float, interpupillary_m: float) -> HeadFrame:
    """The head in the one camera that was placed by it, which is in the template's metres: no rays meet, and its
    landmarks miss by what the fit says.

    Parameters
    ----------
    coefficients : [K], of the identity
    error_px : by which the landmarks miss
    miss : the same as a share of the face's width
    interpupillary_m : how far the pupils lie apart
    """
    right, left = pupils(coefficients)
    apart = float(np.linalg.norm(left - right))
    size = interpupillary_m / apart
    return HeadFrame(
        pycolmap.Sim3d(size, pycolmap.Rotation3d(np.eye(3)), -size * (left + right) / 2), error_px, miss, apart, 0.0
    )


def agreeing_faces(model: pycolmap.Reconstruction, face_by_name: dict[str, faces.Face]) -> dict[str, faces.Face]:
    """Those of the faces found in registered frames whose landmarks meet those of the other frames."""
    seen = _sure(model, face_by_name)
    if len(seen) < 3:
        return {image.name: face for image, face in seen}
    origins, directions = zip(*(rays(image, model.cameras[image.camera_id], face) for image, face in seen), strict=True)
    _, angles = intersect_rays(np.array(origins), np.array(directions))
    focal = np.array([model.cameras[image.camera_id].mean_focal_length() for image, _ in seen])
    good = _together(
        np.median(angles * focal[:, None], axis=1), np.median([face.box[2] - face.box[0] for _, face in seen])
    )
    return {image.name: face for (image, face), kept in zip(seen, good, strict=True) if kept}


def _together(errors: np.ndarray, width: float) -> np.ndarray:
    """bool [N]: frames whose landmarks miss by no more than the others'; errors [N] and the face's width in pixels."""
    good = errors <= max(ASTRAY_RATIO * np.median(errors), ASTRAY_WIDTH_SHARE * width)
    return good if good.sum() >= 2 else np.ones(len(errors), bool)


def rays(image: pycolmap.Image, camera: pycolmap.Camera, face: faces.Face) -> tuple[np.ndarray, np.ndarray]:
    """Centre [3] of a registered image and unit directions [468, 3] of its landmarks, in the model's world."""
    pose = image.cam_from_world() if callable(image.cam_from_world) else image.cam_from_world
    rotation = pose.rotation.matrix()
    plane = np.asarray(camera.cam_from_img(face.landmarks[:, :2].astype(np.float64)))
    directions = np.concatenate([plane, np.ones((len(plane), 1))], 1) @ rotation
    return -rotation.T @ np.asarray(pose.translation), directions / np.linalg.norm(directions, axis=1, keepdims=True)


def intersect_rays(origins: np.ndarray, directions: np.ndarray, rounds: int = 10) -> tuple[np.ndarray, np.ndarray]:
    """The points [P, 3] nearest to rays from origins [N, 3] along unit directions [N, P, 3], robustly (L1 by
    reweighting); and the angles [N, P] in radians by which the rays miss them."""
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


def _sure(model: pycolmap.Reconstruction, face_by_name: dict[str, faces.Face]) -> list[tuple]:
    """Registered images with their faces, without those that the net hardly believes itself, where there are others: in
    a profile it sees a face from in front that is none."""
    seen = [
        (image, face_by_name[image.name])
        for image in sorted(model.images.values(), key=lambda image: image.name)
        if image.has_pose and image.name in face_by_name
    ]
    sure = [pair for pair in seen if pair[1].score > SURE_SCORE]
    return sure if len(sure) >= 2 else seen


def _registered_with_face(model: pycolmap.Reconstruction, face_by_name: dict[str, faces.Face]) -> list[tuple]:
    """Registered images with their faces: those that face the camera most."""
    seen = _sure(model, face_by_name)
    frontal = [pair for pair in seen if abs(pair[1].yaw_deg) < FRONTAL_DEG]
    return frontal if len(frontal) >= 4 else seen
