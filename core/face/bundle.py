# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bundle adjustment of cameras over face landmarks and feature tracks, small enough for plain arrays.

Landmark positions are free, with a prior towards the template's head of the person's own identity, itself free with
prior N(0, 1): a face unlike the template does not bend the cameras. Points are eliminated first. Triggs et al., Bundle
Adjustment: A Modern Synthesis (2000).
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from .landmark_model import INDEPENDENT_LANDMARKS, SIGMA_M, template_landmarks

OFFSET_M = 0.002  # deviation of a person's landmark from the nearest head of the identity space
FOCAL_SIGMA_LOG = 0.35
"""Deviation of the log of an unknown focal length from its prior: from a phone's wide to its portrait lens."""
TOLD_SIGMA_LOG = 0.03
"""Deviation of the log of a focal length that a file states: whole millimetres, and focusing changes it."""
FOCAL_SHARES = np.geomspace(0.7, 3.0, 16)
"""Focal lengths to try where no file states one, as shares of a picture's longer side: 71 to 19 degrees of view."""
PHONE_FOCAL_SHARE = 1.1  # focal length of a phone in the same unit
FEATURE_PX = 1.5  # deviation of a match in cameras placed by the face, where few matches agree and may be wrong
LEAST_LANDMARK_COSINE = 0.15
"""Cosine between a landmark's normal and the camera below which the landmark has slid onto the silhouette."""


@dataclass(frozen=True)
class Bundle:
    """Cameras, points and identity being adjusted.

    rotations [N, 3, 3] and translations [N, 3] into the cameras; focal [G] px with prior [G] and spread [G], the
    deviation of its log; lens [N], the index of each camera's focal; centre [N, 2], principal points px; coefficients
    [K]; points [P, 3] metres in the head's frame, the first 468 the landmarks; feature_px, the deviation of a match.
    """

    rotations: np.ndarray
    translations: np.ndarray
    focal: np.ndarray
    focal_prior: np.ndarray
    focal_spread: np.ndarray
    lens: np.ndarray
    centre: np.ndarray
    coefficients: np.ndarray
    points: np.ndarray
    feature_px: float = FEATURE_PX

    def local(self, camera: np.ndarray, point: np.ndarray) -> np.ndarray:
        """Return points in the frames of cameras [M, 3]."""
        return np.einsum("mij,mj->mi", self.rotations[camera], self.points[point]) + self.translations[camera]

    def project(self, camera: np.ndarray, point: np.ndarray) -> np.ndarray:
        """Return pixels [M, 2] of observations: camera [M], point [M]."""
        local = self.local(camera, point)
        return self.focal[self.lens[camera], None] * local[:, :2] / np.maximum(local[:, 2:], 1e-3) + self.centre[camera]


@dataclass(frozen=True)
class Observations:
    """Observed pixel [M, 2] of point [M] in camera [M]; a landmark where point < 468."""

    camera: np.ndarray
    point: np.ndarray
    pixel: np.ndarray


def place_by_landmarks(groups: list[dict], group_of: dict, names: list[str], pixels: dict) -> Bundle:
    """Place cameras by PnP on the template's mean head, at the best of FOCAL_SHARES.

    groups are [{names, width, height, focal_px or null}], each of one camera; those without a focal length share one.
    pixels maps a name to its landmarks [468, 2]. Terzakis and Lourakis, A Consistently Fast and Globally Optimal
    Solution to the Perspective-n-Point Problem (2020).
    """
    model = template_landmarks()
    trusted = model.trust > 0.2
    best = None
    for factor in FOCAL_SHARES if any(not group["focal_px"] for group in groups) else (1.0,):
        focal = np.array([group["focal_px"] or factor * max(group["width"], group["height"]) for group in groups])
        poses, total = [], 0.0
        for name in names:
            group = groups[group_of[name]]
            matrix = np.array(
                [
                    [focal[group_of[name]], 0, group["width"] / 2],
                    [0, focal[group_of[name]], group["height"] / 2],
                    [0, 0, 1.0],
                ]
            )
            _, turn, shift = cv2.solvePnP(
                model.mean[trusted], pixels[name][trusted], matrix, None, flags=cv2.SOLVEPNP_SQPNP
            )
            projected = cv2.projectPoints(model.mean[trusted], turn, shift, matrix, None)[0][:, 0]
            total += np.median(np.linalg.norm(projected - pixels[name][trusted], axis=1)) / np.ptp(pixels[name][:, 0])
            poses.append((cv2.Rodrigues(turn)[0], shift[:, 0]))
        # a distant face looks much the same through any lens
        total += len(names) * 0.002 * (np.log(factor / PHONE_FOCAL_SHARE) / FOCAL_SIGMA_LOG) ** 2
        if best is None or total < best[0]:
            best = total, focal, poses
    _, focal, poses = best
    prior = np.array(
        [group["focal_px"] or PHONE_FOCAL_SHARE * max(group["width"], group["height"]) for group in groups]
    )
    return Bundle(
        np.array([r for r, _ in poses]),
        np.array([t for _, t in poses]),
        focal,
        prior,
        np.array([TOLD_SIGMA_LOG if group["focal_px"] else FOCAL_SIGMA_LOG for group in groups]),
        np.array([group_of[name] for name in names]),
        np.array([[groups[group_of[n]][side] / 2 for side in ("width", "height")] for n in names]),
        np.zeros(len(model.basis)),
        model.mean.copy(),
    )


def adjust(bundle: Bundle, observations: Observations, rounds: int = 15) -> Bundle:
    """Minimise by Levenberg-Marquardt with the weights of the last residuals (Geman-McClure)."""
    damping, cost = 1e-3, np.inf
    for _ in range(rounds):
        weights = _weights(bundle, observations)
        stepped = _step(bundle, observations, weights, damping)
        now = _cost(stepped, observations, weights)
        cost = _cost(bundle, observations, weights)
        if not now < cost:
            damping *= 10
            if damping > 1e3:
                break
            continue
        bundle, damping = stepped, max(damping / 5, 1e-7)
        if cost - now < 1e-5 * cost:
            break
    return bundle


def _sigma_px(bundle: Bundle, observations: Observations) -> np.ndarray:
    """Return the expected deviation of each observation [M] in pixels: a landmark's is a length on the head."""
    depth = np.maximum(bundle.local(observations.camera, observations.point)[:, 2], 0.05)
    return np.where(
        observations.point < len(template_landmarks().mean),
        SIGMA_M * bundle.focal[bundle.lens[observations.camera]] / depth,
        bundle.feature_px,
    )


def _weights(bundle: Bundle, observations: Observations) -> np.ndarray:
    """Return the weights [M] of observations, 1 / px^2."""
    model = template_landmarks()
    sigma = _sigma_px(bundle, observations)
    error = np.linalg.norm(bundle.project(observations.camera, observations.point) - observations.pixel, axis=1) / sigma
    landmark = observations.point < len(model.mean)
    trust = np.ones(len(error))
    trust[landmark] = model.trust[observations.point[landmark]] * INDEPENDENT_LANDMARKS / model.trust.sum()
    centres = -np.einsum("nij,ni->nj", bundle.rotations, bundle.translations)
    towards = centres[observations.camera[landmark]] - bundle.points[observations.point[landmark]]
    facing = (model.normals[observations.point[landmark]] * towards).sum(1) / np.linalg.norm(towards, axis=1)
    trust[landmark] *= np.clip((facing - LEAST_LANDMARK_COSINE) / 0.3, 0, 1)
    return trust / (1 + (error / 3) ** 2) ** 2 / sigma**2


def _priors(bundle: Bundle) -> tuple[np.ndarray, np.ndarray]:
    """Return residuals of the priors in deviations.

    Those of the landmarks [468, 3] against the head of the identity space, and of the logs of the focal lengths [G].
    """
    model = template_landmarks()
    offsets = (bundle.points[: len(model.mean)] - model.shape(bundle.coefficients)) / OFFSET_M
    return offsets, np.log(bundle.focal / bundle.focal_prior) / bundle.focal_spread


def _cost(bundle: Bundle, observations: Observations, weights: np.ndarray) -> float:
    offset, focal = _priors(bundle)
    error = ((bundle.project(observations.camera, observations.point) - observations.pixel) ** 2).sum(1)
    return float(
        weights @ error + (offset**2).sum() * _offset_weight() + (bundle.coefficients**2).sum() + (focal**2).sum()
    )


def _offset_weight() -> float:
    return INDEPENDENT_LANDMARKS / len(template_landmarks().mean)


def focal_deviation(bundle: Bundle, observations: Observations) -> np.ndarray:
    """Return the deviations [G] of the logs of the focal lengths, by the inverse of the normal equations.

    They grow with the misses of the observations where these are larger than expected.
    """
    weights = _weights(bundle, observations)
    u, _, v, _, w = _normal_equations(bundle, observations, weights)
    folded = np.einsum("pij,pjs->pis", np.linalg.inv(v + 1e-6 * np.eye(3)), w)
    covariance = np.linalg.inv(u - w.reshape(-1, len(u)).T @ folded.reshape(-1, len(u)) + 1e-9 * np.eye(len(u)))
    lenses = 6 * len(bundle.rotations) + np.arange(len(bundle.focal))
    error = ((bundle.project(observations.camera, observations.point) - observations.pixel) ** 2).sum(1)
    freedom = max(1, 2 * len(error) - len(u) - 3 * len(np.unique(observations.point)))
    return np.sqrt(np.diag(covariance)[lenses] * max(1.0, weights @ error / freedom))


def _step(bundle: Bundle, observations: Observations, weights: np.ndarray, damping: float) -> Bundle:
    views, groups = len(bundle.rotations), len(bundle.focal)
    u, g, v, h, w = _normal_equations(bundle, observations, weights)
    shared = len(u)
    tail, lenses = slice(6 * views + groups, shared), np.arange(6 * views, 6 * views + groups)
    u[np.diag_indices(shared)] *= 1 + damping
    u[np.diag_indices(shared)] += 1e-9
    v += damping * np.eye(3) * np.trace(v, axis1=1, axis2=2)[:, None, None] / 3 + 1e-6 * np.eye(3)
    inverse = np.linalg.inv(v)
    folded = np.einsum("pij,pjs->pis", inverse, w)
    reduced = u - w.reshape(-1, shared).T @ folded.reshape(-1, shared)
    step = -np.linalg.solve(reduced, g - np.einsum("pis,pi->s", folded, h))
    points = bundle.points - np.einsum("pij,pj->pi", inverse, h) - folded @ step
    turns = step[: 6 * views].reshape(views, 6)
    rotations = np.array(
        [cv2.Rodrigues(turn[:3])[0] @ rotation for turn, rotation in zip(turns, bundle.rotations, strict=True)]
    )
    return replace(
        bundle,
        rotations=rotations,
        translations=bundle.translations + turns[:, 3:],
        points=points,
        focal=bundle.focal * np.exp(np.clip(step[lenses], -0.3, 0.3)),
        coefficients=bundle.coefficients + step[tail],
    )


def _normal_equations(bundle: Bundle, observations: Observations, weights: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return u [S, S], g [S] of cameras, lenses and identity, v [P, 3, 3], h [P, 3] of points, and w [P, 3, S]."""
    model = template_landmarks()
    marks, count, views, groups = len(model.mean), len(bundle.points), len(bundle.rotations), len(bundle.focal)
    shared = 6 * views + groups + len(bundle.coefficients)
    local = bundle.local(observations.camera, observations.point)
    depth, focal = np.maximum(local[:, 2], 1e-3), bundle.focal[bundle.lens[observations.camera]]
    residual = focal[:, None] * local[:, :2] / depth[:, None] + bundle.centre[observations.camera] - observations.pixel
    by_local = np.zeros((len(local), 2, 3))  # d pixel / d local
    by_local[:, 0, 0] = by_local[:, 1, 1] = focal / depth
    by_local[:, :, 2] = -focal[:, None] * local[:, :2] / depth[:, None] ** 2
    by_camera = np.zeros((len(local), 2, 7))  # turn about the camera, translation, log focal
    turned = local - bundle.translations[observations.camera]
    for axis in range(3):
        by_camera[:, :, axis] = (by_local @ np.cross(np.eye(3)[axis], turned)[..., None])[..., 0]
    by_camera[:, :, 3:6] = by_local
    by_camera[:, :, 6] = focal[:, None] * local[:, :2] / depth[:, None]
    by_point = by_local @ bundle.rotations[observations.camera]

    # [M, 7]
    columns = np.concatenate(
        [6 * observations.camera[:, None] + np.arange(6), 6 * views + bundle.lens[observations.camera][:, None]], 1
    )
    heavy = weights[:, None, None]
    u, g = np.zeros((shared, shared)), np.zeros(shared)
    np.add.at(u, (columns[:, :, None], columns[:, None, :]), np.einsum("mia,mib->mab", by_camera * heavy, by_camera))
    np.add.at(g, columns, np.einsum("mia,mi->ma", by_camera * heavy, residual))
    v, h = np.zeros((count, 3, 3)), np.zeros((count, 3))
    np.add.at(v, observations.point, np.einsum("mia,mib->mab", by_point * heavy, by_point))
    np.add.at(h, observations.point, np.einsum("mia,mi->ma", by_point * heavy, residual))
    w = np.zeros((count, 3, shared))
    np.add.at(
        w,
        (observations.point[:, None, None], np.arange(3)[None, :, None], columns[:, None, :]),
        np.einsum("mia,mib->mab", by_point * heavy, by_camera),
    )

    offset, focal_off = _priors(bundle)
    tail, strength = slice(6 * views + groups, shared), _offset_weight() / OFFSET_M**2
    v[:marks] += strength * np.eye(3)
    h[:marks] += strength * OFFSET_M * offset
    basis = model.basis.transpose(1, 2, 0)  # [468, 3, K]
    w[:marks, :, tail] -= strength * basis
    flat = basis.reshape(-1, basis.shape[-1])
    u[tail, tail] += strength * flat.T @ flat + np.eye(flat.shape[1])
    g[tail] += bundle.coefficients - strength * OFFSET_M * flat.T @ offset.ravel()
    lenses = np.arange(6 * views, 6 * views + groups)
    u[lenses, lenses] += 1 / bundle.focal_spread**2
    g[lenses] += focal_off / bundle.focal_spread
    return u, g, v, h, w
