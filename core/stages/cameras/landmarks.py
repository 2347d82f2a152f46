# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Face landmarks: in the frames, on the template as a head of its identity space, and the similarity between.

All 432 trusted landmarks determine scale and upright, not the corners of the eyes alone, which a net misplaces when
lids are closed. Umeyama, Least-squares Estimation of Transformation Parameters (1991).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from ...capture.frame_records import FrameRecord
from ...capture.messages import Reporter
from ...face import faces
from ...face.landmark_model import INDEPENDENT_LANDMARKS, SIGMA_M, template_landmarks
from ...imaging import images

LEFT_LIDS, RIGHT_LIDS = faces.EYE_LINES
PUPILS_PER_LIDS = 63.0 / 62.156 / 1.019
"""The template's pupils are 63 mm apart, the middles of its lids' outlines a little less; and the head that fits a
net's landmarks came out 1.9 % too large over six synthetic heads of known size
(research/benchmarks/head/head_scale.py)."""


def find_landmarks(
    records: Sequence[FrameRecord], folder: Path, report: Reporter, text: str = "finding the face"
) -> dict[str, faces.Face]:
    """Detect the face in each frame of a folder and return name -> face, without the frames that show none.

    A turned head is tracked from the frame before and the one after, which are near in a film; in photographs only if
    no face is detected otherwise.
    """
    face_by_name: dict[str, faces.Face] = {}
    last = None
    for index, record in enumerate(records):
        report.progress(index, len(records), text)
        srgb = images.read_srgb(folder / record.name)
        face = faces.detect(srgb, last if record.time_s is not None else None)
        if face is None and last is not None and record.time_s is None:
            face = faces.detect(srgb, last)
        last = face
        if last is not None:
            face_by_name[record.name] = last
    for record, following in zip(records[-2::-1], records[:0:-1], strict=True):
        if record.name not in face_by_name and following.name in face_by_name:
            face = faces.detect(images.read_srgb(folder / record.name), face_by_name[following.name])
            if face is not None:
                face_by_name[record.name] = face
        report.check()
    return face_by_name


def fit_rays(
    origins: np.ndarray, directions: np.ndarray, points: np.ndarray, rounds: int = 20
) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """Fit the template's head to landmarks along rays.

    origins: [N, 3]; directions: [N, 468, 3], unit; points: [468, 3], roughly the landmarks' places. Returns scale,
    rotation [3, 3] and translation [3] from the head's metres into the rays' world, and identity coefficients [K],
    prior N(0, 1). Measured across the rays: a net's landmarks slide as the head turns, so that the depths at which they
    intersect are exaggerated. Gauss-Newton; outliers are weighted down by their distance (Geman-McClure).
    """
    model = template_landmarks()
    across = np.eye(3) - directions[..., :, None] * directions[..., None, :]  # [N, 468, 3, 3]
    scale, rotation, translation = similarity(model.mean, points, model.trust)
    count = len(model.basis)
    coefficients = np.zeros(count)
    prior = np.concatenate([np.full(7, 1e-9), np.ones(count)])
    for _ in range(rounds):
        at = scale * model.shape(coefficients) @ rotation.T + translation
        miss = (across @ (at[None] - origins[:, None])[..., None])[..., 0] / scale  # [N, 468, 3] metres on the head
        weights = robust_weights(np.linalg.norm(miss, axis=-1), model.trust)
        # d point / d (rotation, translation, log scale, coefficients), in metres on the head
        jacobian = np.zeros((len(at), 3, 7 + count))
        arm = (at - translation) / scale
        for axis in range(3):
            jacobian[:, :, axis] = np.cross(np.eye(3)[axis], arm)
            jacobian[:, axis, 3 + axis] = 1
        jacobian[:, :, 6] = arm
        jacobian[:, :, 7:] = np.einsum("kpi,ji->pjk", model.basis, rotation)
        information = np.einsum("np,npij->pij", weights, across)
        normal = np.einsum("pia,pij,pjb->ab", jacobian, information, jacobian, optimize=True) + np.diag(prior)
        pull = np.einsum("pia,pi->a", jacobian, np.einsum("np,npi->pi", weights, miss))
        right = -pull - prior * np.concatenate([np.zeros(7), coefficients])
        step = np.linalg.solve(normal, right)
        rotation = cv2.Rodrigues(step[:3])[0] @ rotation
        translation = translation + scale * step[3:6]
        scale *= float(np.exp(step[6]))
        coefficients = coefficients + step[7:]
    return scale, rotation, translation, coefficients


def robust_weights(miss_m: np.ndarray, trust: np.ndarray) -> np.ndarray:
    """Return weights [N, 468] in 1 / m^2 of landmarks from their misses [N, 468].

    They add up to INDEPENDENT_LANDMARKS landmarks.
    """
    weights = trust / (1 + (miss_m / (2.5 * np.maximum(np.median(miss_m, axis=1, keepdims=True), 1e-4))) ** 2) ** 2
    return weights * INDEPENDENT_LANDMARKS / weights.sum() / SIGMA_M**2


def pupils(coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the right and the left pupil [3] of the template's head with these coefficients, in its metres."""
    shape = template_landmarks().shape(coefficients)
    right, left = shape[list(RIGHT_LIDS)].mean(0), shape[list(LEFT_LIDS)].mean(0)
    middle, half = (right + left) / 2, PUPILS_PER_LIDS * (left - right) / 2
    return middle - half, middle + half


def similarity(source: np.ndarray, target: np.ndarray, weights: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Return scale, rotation [3, 3], translation [3] from source [N, 3] to target, by weighted least squares."""
    weights = weights / weights.sum()
    a, b = source - weights @ source, target - weights @ target
    u, s, vt = np.linalg.svd((b * weights[:, None]).T @ a)
    sign = np.array([1, 1, np.sign(np.linalg.det(u @ vt))])
    rotation = u * sign @ vt
    scale = float((s * sign).sum() / (weights @ (a**2).sum(1)))
    return scale, rotation, weights @ target - scale * rotation @ (weights @ source)
