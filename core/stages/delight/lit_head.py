# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Registered head of a capture with the light that was fitted to its skin in all frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...capture.messages import Problem, Reporter
from ...face.head import Head
from ...geometry.meshes import Mesh
from ...geometry.raster import RayCaster, interpolate
from ...geometry.views import View
from ...geometry.visibility import reached_by_sun
from ...light.skylight import radiance_transfer
from ...light.sunlight import Light, fit_light
from .surface import skin_weights, smooth_normals, vertex_colours

MAX_ALBEDO = 0.85  # largest channel of a tone: more than skin reflects, so a brighter picture was over-exposed
FEWEST_POINTS = 200  # with fewer points that two views show, those that only one shows count as well
UNKNOWNS = 10  # of the light in each colour: the sky's nine coefficients and the sun


@dataclass(frozen=True)
class LitHead:
    """Head with its light.

    normals: smoothed, unit [V, 3]; transfer [V, 9] of the sky; skin [V]: 1 on bare facial skin; hair [V]: share of the
    views that show hair, eyes or cloth there; features [V]: 1 on brows and lips; best_lit [3]: linear colour of the
    best lit skin, taken for that of the skin itself.
    """

    head: Head
    normals: np.ndarray
    transfer: np.ndarray
    skin: np.ndarray
    hair: np.ndarray
    features: np.ndarray
    light: Light
    best_lit: np.ndarray

    @property
    def mesh(self) -> Mesh:
        return self.head.mesh

    @property
    def caster(self) -> RayCaster:
        return self.head.caster

    def at(self, face: np.ndarray, bary: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Shade a raster of the head: face [h, w] (-1: none), bary [h, w, 3].

        Returns the linear colour of its skin under the sky [h, w, 3], what an unblocked sun adds [h, w, 3], 1 where the
        head itself leaves the sun visible [h, w], and unit normals [h, w, 3].
        """
        normal = interpolate(self.normals, self.mesh.faces, face, bary)
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-9)
        ambient = self.light.ambient(interpolate(self.transfer, self.mesh.faces, face, bary))
        free = np.zeros(face.shape)
        if self.light.has_sun:
            here = face >= 0
            position = interpolate(self.mesh.vertices, self.mesh.faces, face, bary)[here]
            free[here] = reached_by_sun(self.caster, position, normal[here], self.light.sun)
        return ambient, self.light.direct(normal), free, normal


def fit_lit_head(head: Head, views: list[View], report: Reporter) -> LitHead:
    """Fit the light of these views to the head; half of the stage's progress.

    Raises Problem if the views hardly see it, or no bare skin of it.
    """
    normals = smooth_normals(head)
    colours, count, hair, brows = vertex_colours(head, normals, views, report)
    transfer = radiance_transfer(
        head.caster,
        head.mesh.vertices,
        normals,
        step=lambda done, of: report.progress(2 * of + done, 8 * of, "Casting rays at the sky"),
    )
    skin, features = skin_weights(head)
    skin, features = skin * (1 - hair) * (1 - brows), np.maximum(features, brows)
    bare = (skin > 0.3) & (colours.min(1) > 1e-3)
    often = bare & (count >= min(2, len(views)))
    weights = skin * (often if often.sum() >= FEWEST_POINTS else bare)
    light, reached = _fit(head, normals, transfer, colours, weights, report)
    best_lit = _best_lit(light, normals, transfer, reached, count)
    return LitHead(head, normals, transfer, skin, hair, features, light, best_lit)


def _fit(head, normals, transfer, colours, weights, report) -> tuple[Light, np.ndarray]:
    """Fit the light to the skin's vertices; return it and the posterior [V] that its sun reaches them, else 0."""
    skin = np.flatnonzero(weights)
    if len(skin) < UNKNOWNS:
        raise Problem(
            "The selected frames show no bare skin of the face.",
            "Film the face from in front as well, or choose another delighter: Folder or None.",
        )
    points, facing = head.mesh.vertices[skin], normals[skin]
    light, lit, inlier = fit_light(
        colours[skin],
        facing,
        transfer[skin],
        lambda sun: reached_by_sun(head.caster, points, facing, sun).astype(float),
        weights[skin],
        step=lambda done, of: report.progress(3 * of + done, 8 * of, "Fitting the light"),
    )
    ambient = light.ambient(transfer[skin])
    expected = ambient + lit[:, None] * light.direct(facing)
    residual = np.abs(np.log(colours[skin] / np.maximum(expected, 1e-4))).mean(1)
    report.figure("inlier_percent", round(100 * float(inlier.mean()), 1))
    report.figure("residual_log", round(float(np.median(residual[inlier > 0.5])), 3))
    report.figure("environment_sh", np.round(light.environment, 4).tolist())
    report.figure("sun_direction", np.round(light.sun, 3).tolist() if light.has_sun else None)
    report.figure("sun_to_sky", round(float(light.colour[1] / np.median(ambient[:, 1])), 2))
    reached = np.zeros(len(normals))
    reached[skin] = lit
    return light, reached


def _best_lit(light, normals, transfer, reached, count) -> np.ndarray:
    """Return the colour [3] of the best lit tenth of the skin."""
    lit = (light.ambient(transfer) + reached[:, None] * light.direct(normals))[count > 0]
    tone = lit[lit.mean(1) >= np.quantile(lit.mean(1), 0.9)].mean(0)
    return tone * min(1.0, MAX_ALBEDO / tone.max())
