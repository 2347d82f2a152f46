# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Alignment of the template, as a head of its identity space, with the landmarks and then with the scan.

A similarity and coefficients with prior N(0, 1) are found together by Gauss-Newton; the first guess of the similarity
is Umeyama's closed form (1991).
"""

from dataclasses import dataclass

import numpy as np

from ...geometry.meshes import Mesh, vertex_normals
from .correspondence import Scan, biweight

LANDMARK_SIGMA_M = 0.002
SCAN_SIGMA_M = 0.002  # distance of the identity space from a person; no scan is that bad
SCAN_ROUNDS = 15  # Gauss-Newton steps towards the scan; the reach shrinks over them
INDEPENDENT_COUNTS = {"landmarks": 120, "scan": 100}
"""Numbers that count as independent; neighbours err together, and a brow must not slide up a smooth forehead."""


@dataclass(frozen=True)
class Similarity:
    scale: float
    rotation: np.ndarray
    translation: np.ndarray

    def apply(self, points: np.ndarray) -> np.ndarray:
        return self.scale * points @ self.rotation.T + self.translation


@dataclass(frozen=True)
class HeadModel:
    """Template of a fit.

    mesh, identity [K, V, 3], landmark anchors (face [468], bary [468, 3]) and their weights [468].
    """

    mesh: Mesh
    identity: np.ndarray
    landmark_face: np.ndarray
    landmark_bary: np.ndarray
    landmark_weight: np.ndarray

    def shape(self, coefficients: np.ndarray) -> np.ndarray:
        """Return vertices [V, 3] in the template's own frame."""
        return self.mesh.vertices + np.tensordot(coefficients, self.identity, 1)

    def at_landmarks(self, vertices: np.ndarray) -> np.ndarray:
        """Interpolate values of the vertices [..., V, 3] at the landmarks [..., 468, 3]."""
        return (vertices[..., self.mesh.faces[self.landmark_face], :] * self.landmark_bary[..., None]).sum(-2)


def similarity(source: np.ndarray, target: np.ndarray, weights: np.ndarray) -> Similarity:
    """Fit the least-squares similarity of source [N, 3] onto target [N, 3], weights [N] (Umeyama 1991)."""
    weights = weights / weights.sum()
    a, b = weights @ source, weights @ target
    u, d, vt = np.linalg.svd(((target - b) * weights[:, None]).T @ (source - a))
    sign = np.array([1, 1, np.sign(np.linalg.det(u @ vt))])
    rotation = u * sign @ vt
    scale = (d * sign).sum() / (weights @ ((source - a) ** 2).sum(1))
    return Similarity(float(scale), rotation, b - scale * rotation @ a)


def fit_landmarks(
    model: HeadModel, points: np.ndarray, trust: np.ndarray, rounds: int = 12
) -> tuple[Similarity, np.ndarray]:
    """Fit a similarity and identity coefficients [K] to landmarks.

    points [468, 3] in metres (nan: unknown), trust [468] in [0, 1].
    """
    valid, weights = _usable(model, points, trust)
    coefficients = np.zeros(len(model.identity))
    rest = model.at_landmarks(model.mesh.vertices)[valid]
    pose = similarity(rest, points[valid], weights)
    for _ in range(3):  # robust start: a few bad landmarks must not tilt the head
        error = np.linalg.norm(pose.apply(rest) - points[valid], axis=1)
        pose = similarity(rest, points[valid], weights / (1 + (error / (2 * np.median(error) + 1e-9)) ** 2))
    for _ in range(rounds):
        pose, coefficients = _step(model, pose, coefficients, points, trust)
    return pose, coefficients


def fit_scan(
    model: HeadModel,
    pose: Similarity,
    coefficients: np.ndarray,
    points: np.ndarray,
    trust: np.ndarray,
    scan: Scan,
    shaped: np.ndarray,
) -> tuple[Similarity, np.ndarray]:
    """Refine `fit_landmarks` with point-to-plane distances of the vertices to a scan.

    shaped [V] in [0, 1] is the weight of each vertex.
    """
    index = np.flatnonzero(shaped > 0.05)
    index = index[:: max(1, len(index) // 4000)]
    for step in range(SCAN_ROUNDS):
        vertices = pose.apply(model.shape(coefficients))
        normals = vertex_normals(model.mesh.moved(vertices))[index]
        # the identity space is no closer to a person than this
        reach = np.interp(step, [0, SCAN_ROUNDS - 1], [0.030, 0.010])
        signed, scan_normals = scan.match(vertices[index], normals, 1.5 * reach)
        weight = biweight(signed, reach) * shaped[index]
        weight *= min(1.0, INDEPENDENT_COUNTS["scan"] / max(weight.sum(), 1)) / SCAN_SIGMA_M**2
        pose, coefficients = _step(
            model, pose, coefficients, points, trust, (index, np.nan_to_num(signed), scan_normals, weight)
        )
    return pose, coefficients


def _usable(model: HeadModel, points: np.ndarray, trust: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    valid = np.isfinite(points).all(1) & (trust * model.landmark_weight > 0)
    return valid, (trust * model.landmark_weight)[valid]


def _step(model, pose, coefficients, points, trust, planes=None) -> tuple[Similarity, np.ndarray]:
    """Take one Gauss-Newton step on [rotation 3, translation 3, log scale 1, coefficients K]."""
    valid, weights = _usable(model, points, trust)
    turn = pose.scale * pose.rotation.T
    at = pose.apply(model.at_landmarks(model.shape(coefficients)))[valid]
    residual = points[valid] - at
    error = np.linalg.norm(residual, axis=1)
    weights = weights / (1 + (error / (2.5 * LANDMARK_SIGMA_M)) ** 2) / LANDMARK_SIGMA_M**2
    weights = weights * min(1.0, INDEPENDENT_COUNTS["landmarks"] / len(weights))
    basis = model.at_landmarks(model.identity)[:, valid] @ turn  # [K, N, 3]
    jacobian = _jacobian(at, pose.translation, basis).reshape(-1, 7 + len(coefficients))
    rows = [(jacobian, residual.reshape(-1), np.repeat(weights, 3))]
    if planes is not None:
        index, signed, normals, weight = planes
        at = pose.apply(model.shape(coefficients)[index])
        basis = model.identity[:, index] @ turn
        full = _jacobian(at, pose.translation, basis)  # [N, 3, P]
        rows.append(((full * normals[..., None]).sum(1), signed, weight))
    return _solve(pose, coefficients, rows)


def step_towards(pose: Similarity, coefficients: np.ndarray, constraints: list[tuple]) -> tuple[Similarity, np.ndarray]:
    """Take one such step for points that should move along directions.

    constraints holds for each kind of them the points [M, 3], their identity basis [K, M, 3] in the model's own frame,
    unit directions [M, 3], distances [M] in metres and weights [M] in 1 / m^2.
    """
    rows = []
    for at, basis, direction, distance, weight in constraints:
        full = _jacobian(at, pose.translation, basis @ (pose.scale * pose.rotation.T))
        rows.append(((full * direction[..., None]).sum(1), distance, weight))
    return _solve(pose, coefficients, rows)


def _solve(pose: Similarity, coefficients: np.ndarray, rows: list[tuple]) -> tuple[Similarity, np.ndarray]:
    """Solve for rows (jacobian [M, 7 + K], residual [M], weight [M]) of each kind of data, and apply the step."""
    prior = np.concatenate([np.zeros(7), np.ones(len(coefficients))])
    normal_matrix, right = np.diag(prior + 1e-9), -prior * np.concatenate([np.zeros(7), coefficients])
    for jacobian, residual, weight in rows:
        normal_matrix = normal_matrix + (jacobian * weight[:, None]).T @ jacobian
        right = right + jacobian.T @ (weight * residual)
    delta = np.linalg.solve(normal_matrix, right)
    rotation = _rotation(delta[:3])
    pose = Similarity(float(pose.scale * np.exp(delta[6])), rotation @ pose.rotation, pose.translation + delta[3:6])
    return pose, coefficients + delta[7:]


def _jacobian(at: np.ndarray, translation: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Return d point / d parameters [N, 3, 7 + K] of points `at` [N, 3], turned about `translation`."""
    arm = at - translation
    jacobian = np.zeros((len(at), 3, 7 + len(basis)))
    for axis in range(3):
        jacobian[:, :, axis] = np.cross(np.eye(3)[axis], arm)
        jacobian[:, axis, 3 + axis] = 1
    jacobian[:, :, 6] = arm
    jacobian[:, :, 7:] = basis.transpose(1, 2, 0)
    return jacobian


def _rotation(vector: np.ndarray) -> np.ndarray:
    """Return Rodrigues' rotation."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / max(angle, 1e-12)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
