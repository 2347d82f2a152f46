# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Face landmarks on the built-in head and on every head of its identity space."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..geometry import meshes
from ..geometry.meshes import unit
from . import template

SIGMA_M = 0.003  # typical distance of the network's landmark from the same point of a person's head
INDEPENDENT_LANDMARKS = 120  # number of landmarks that count as independent: neighbours err together


@dataclass(frozen=True)
class TemplateLandmarks:
    """Landmarks of the template.

    mean [468, 3] and identity basis [K, 468, 3] in metres, outward normals [468, 3], trust [468] in [0, 1].
    """

    mean: np.ndarray
    basis: np.ndarray
    normals: np.ndarray
    trust: np.ndarray

    def shape(self, coefficients: np.ndarray) -> np.ndarray:
        """Return the landmarks [468, 3] of the head with these identity coefficients [K]."""
        return self.mean + np.tensordot(coefficients, self.basis, 1)


@cache
def template_landmarks() -> TemplateLandmarks:
    mesh, at_landmarks = template.load(), template.at_landmarks
    normals = at_landmarks(meshes.vertex_normals(mesh))
    return TemplateLandmarks(
        at_landmarks(mesh.vertices),
        at_landmarks(template.identity()).astype(np.float64),
        unit(normals),
        template.landmark_weights(),
    )
