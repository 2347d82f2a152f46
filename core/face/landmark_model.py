# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The landmarks of a face on the built-in head and on every head of its identity space."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..geometry import meshes
from . import template

SIGMA_M = 0.003
"""How far a landmark of the net lies from the same point of a person's head, roughly."""
INDEPENDENT_LANDMARKS = 120
"""How many of the landmarks count as independent: neighbours err together."""


@dataclass(frozen=True)
class TemplateLandmarks:
    """The template's landmarks: mean [468, 3] and identity basis [K, 468, 3] in metres, outward normals [468, 3], trust
    [468] in [0, 1]."""

    mean: np.ndarray
    basis: np.ndarray
    normals: np.ndarray
    trust: np.ndarray

    def shape(self, coefficients: np.ndarray) -> np.ndarray:
        """The landmarks [468, 3] of the head with these identity coefficients [K]."""
        return self.mean + np.tensordot(coefficients, self.basis, 1)


@cache
def template_landmarks() -> TemplateLandmarks:
    mesh, (face, bary) = template.load(), template.landmarks()

    def at(vertex_values: np.ndarray) -> np.ndarray:
        return (vertex_values[..., mesh.faces[face], :] * bary[..., None]).sum(-2)

    normals = at(meshes.vertex_normals(mesh))
    return TemplateLandmarks(
        at(mesh.vertices),
        at(template.identity()).astype(np.float64),
        normals / np.linalg.norm(normals, axis=1, keepdims=True),
        template.landmark_weights(),
    )
