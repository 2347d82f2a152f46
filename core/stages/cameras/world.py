# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From any world of cameras to the head's: metres, +Z up, face towards -Y, origin midway between the eyes.

Face landmarks of several frames are rays; the template's head fitted to them gives upright and, by its pupils, scale.
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
"""Score above which a face is certain; the net gives a real one 0.95 and more."""
FRONTAL_DEG = 45.0
"""Landmarks slide along the silhouette of a turned head, so frames within this yaw are taken where there are enough."""
PUPILS_M = 0.063
"""How far apart the template's pupils are."""
MOVED_WIDTH_SHARE = 0.08
"""Share of the face's width by which the landmarks' rays may miss each other in a quarter of the frames before the head
counts as moved."""


@dataclass(frozen=True)
class HeadFrame:
    """Similarity into the head's world, and how well the head fits.

    error_px: the landmark rays' miss of each other [px, median over frames and landmarks]; miss: the same as a share of
    the face's width, at the worst quarter of the frames; pupils_apart: in units of the cameras' own world; unlike_m:
    the template head's median miss of the rays, in metres.
    """

    world_from_model: pycolmap.Sim3d
    error_px: float
    miss: float
    pupils_apart: float
    unlike_m: float

    @property
    def template_from_model(self) -> pycolmap.Sim3d:
        """Similarity into the template's own world: the head's, but with pupils PUPILS_M apart."""
        into = self.world_from_model
        size = PUPILS_M / (into.scale * self.pupils_apart)
        return pycolmap.Sim3d(size * into.scale, into.rotation, size * into.translation)

    @property
    def still(self) -> bool:
        """Whether the head kept still with respect to what the cameras were solved from."""
        return self.miss <= MOVED_WIDTH_SHARE


def find_head(
    model: pycolmap.Reconstruction, face_by_name: dict[str, faces.Face], interpupillary_m: float
) -> HeadFrame:
    """Return the head in a model. Raises Problem if fewer than two registered frames show a face."""
    views = _registered_with_face(model, face_by_name)
    if len(views) < 2:
        raise Problem(
            "The face is seen in fewer than two of the frames whose cameras were found.",
            "Film so that eyes, nose and mouth stay visible in most of the frames.",
        )
    origins, directions = zip(
        *(rays(image, model.cameras[image.camera_id], face) for image, face in views), strict=True
    )
    origins, directions = np.array(origins), np.array(directions)
    points, angles = intersect_rays(origins, directions)
    focal = np.array([model.cameras[image.camera_id].mean_focal_length() for image, _ in views])
    width = np.median([face.box[2] - face.box[0] for _, face in views])
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
    """Return the head in a single camera that was placed by it, which is in the template's metres.

    No rays meet there, so the miss is that of the fit: error_px, and `miss` as a share of the face's width.
    coefficients: identity [K].
    """
    right, left = pupils(coefficients)
    apart = float(np.linalg.norm(left - right))
    size = interpupillary_m / apart
    return HeadFrame(
        pycolmap.Sim3d(size, pycolmap.Rotation3d(np.eye(3)), -size * (left + right) / 2), error_px, miss, apart, 0.0
    )


def agreeing_faces(model: pycolmap.Reconstruction, face_by_name: dict[str, faces.Face]) -> dict[str, faces.Face]:
    """Return the faces in registered frames whose landmarks meet those of the other frames."""
    views = _sure(model, face_by_name)
    if len(views) < 3:
        return {image.name: face for image, face in views}
    origins, directions = zip(
        *(rays(image, model.cameras[image.camera_id], face) for image, face in views), strict=True
    )
    _, angles = intersect_rays(np.array(origins), np.array(directions))
    focal = np.array([model.cameras[image.camera_id].mean_focal_length() for image, _ in views])
    good = _together(
        np.median(angles * focal[:, None], axis=1), np.median([face.box[2] - face.box[0] for _, face in views])
    )
    return {image.name: face for (image, face), keep in zip(views, good, strict=True) if keep}


def _together(errors: np.ndarray, width: float) -> np.ndarray:
    """Return a mask [N] of frames that miss by no more than the others; errors [N] and width in pixels."""
    good = errors <= max(ASTRAY_RATIO * np.median(errors), ASTRAY_WIDTH_SHARE * width)
    return good if good.sum() >= 2 else np.ones(len(errors), bool)


def rays(image: pycolmap.Image, camera: pycolmap.Camera, face: faces.Face) -> tuple[np.ndarray, np.ndarray]:
    """Return a registered image's centre [3] and unit directions [468, 3] of its landmarks, in the model's world."""
    pose = image.cam_from_world() if callable(image.cam_from_world) else image.cam_from_world
    rotation = pose.rotation.matrix()
    plane = np.asarray(camera.cam_from_img(face.landmarks[:, :2].astype(np.float64)))
    directions = np.concatenate([plane, np.ones((len(plane), 1))], 1) @ rotation
    return -rotation.T @ np.asarray(pose.translation), directions / np.linalg.norm(directions, axis=1, keepdims=True)


def intersect_rays(origins: np.ndarray, directions: np.ndarray, rounds: int = 10) -> tuple[np.ndarray, np.ndarray]:
    """Return points [P, 3] nearest to rays, and the angles [N, P] in radians by which the rays miss them.

    origins: [N, 3]; directions: [N, P, 3], unit. Robust: L1 by reweighting.
    """
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
    """Return registered images with their faces, without those of a low score if there are others.

    In a profile the net sees a frontal face that is not there.
    """
    views = [
        (image, face_by_name[image.name])
        for image in sorted(model.images.values(), key=lambda image: image.name)
        if image.has_pose and image.name in face_by_name
    ]
    sure = [pair for pair in views if pair[1].score > SURE_SCORE]
    return sure if len(sure) >= 2 else views


def _registered_with_face(model: pycolmap.Reconstruction, face_by_name: dict[str, faces.Face]) -> list[tuple]:
    """Return registered images with their faces, preferably frontal ones."""
    views = _sure(model, face_by_name)
    frontal = [pair for pair in views if abs(pair[1].yaw_deg) < FRONTAL_DEG]
    return frontal if len(frontal) >= 4 else views
