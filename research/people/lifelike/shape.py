# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head beyond registration's identity basis: a member of it plus a smooth, mostly symmetric displacement.

What the basis or a motion of the head explains is taken from the displacement. It is a random field and, where its
folder is given, one of ICT-FaceKit's identities as well (facekit.py).
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from core.face import template
from core.geometry import raster
from core.geometry.meshes import Mesh, vertex_uvs
from core.geometry.noise import octaves

from ..identities import identity_coefficients
from .facekit import fields

WAVELENGTHS_MM = [140.0, 90.0]  # of the random field: smaller ones are caricatures at this strength
ASYMMETRY = 0.35  # deviation of the asymmetric part over that of the symmetric one
WITHIN = 0.6  # of the bald subjects' strength in the basis, so that both parts together stay a plausible head
# share of ICT-FaceKit in the displacement where its folder is given, the rest is the random field: alone and this
# strong it ages every face
FACEKIT = 0.6
RESIDUAL_MM = 2.05, 2.3  # root mean square over the face that the basis leaves


def person_mesh(seed: int, facekit: Path | None = None) -> Mesh:
    """Return a person's closed head in the template's topology and pose: metres, +Z up, face towards -Y."""
    rng = np.random.default_rng([seed, 60])
    basis = np.tensordot(WITHIN * identity_coefficients(seed), template.identity(), 1)
    outside = _lessened(_random_field(rng))
    if facekit:
        outside = (1 - FACEKIT) * outside + FACEKIT * _lessened(_from_facekit(facekit, rng))
    outside *= rng.uniform(*RESIDUAL_MM) / 1000 / root_mean_square(unexplained(outside))
    return template.load().moved(template.load().vertices + basis + outside)


def unexplained(displacement: np.ndarray) -> np.ndarray:
    """Return the part of a displacement [V, 3] that no identity, rotation, translation or scale explains.

    By least squares over the face.
    """
    return _without_basis(displacement, face_weight())


def _lessened(displacement: np.ndarray) -> np.ndarray:
    """Return the smallest displacement of the whole head that a basis fit to the face leaves as much of.

    What the basis explains may go, but so that the back of the head stays where it is. Scaled to leave a root mean
    square of 1.
    """
    lessened = _without_basis(displacement, 0.25 + 0.75 * face_weight())
    return lessened / root_mean_square(unexplained(lessened))


def _without_basis(displacement: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Subtract from a displacement [V, 3] its least-squares fit by the design, vertices counted by weight [V]."""
    design, root = _design(), np.sqrt(weight)
    system = (design * root[:, None, None]).reshape(3 * len(root), -1)
    return displacement - design @ np.linalg.lstsq(system, (displacement * root[:, None]).reshape(-1), rcond=None)[0]


def root_mean_square(displacement: np.ndarray) -> float:
    """Return the root mean square of a displacement's lengths [V, 3] over the face."""
    weight = face_weight()
    return float(np.sqrt((weight * (displacement**2).sum(1)).sum() / weight.sum()))


@cache
def face_weight() -> np.ndarray:
    """Return the share [V] in [0, 1] to which each vertex of the template belongs to the face."""
    return raster.sample_uv(template.mask("face", 512), vertex_uvs(template.load())).astype(np.float64)


@cache
def _design() -> np.ndarray:
    """Return the displacements [V, 3, 7 + K] of small rotations, translations, a scale and the identities."""
    points = template.load().vertices
    turns = [np.cross(np.eye(3)[axis], points) for axis in range(3)]
    moves = [np.broadcast_to(np.eye(3)[axis], points.shape) for axis in range(3)]
    return np.stack([*turns, *moves, points, *template.identity().astype(np.float64)], -1)


def _random_field(rng: np.random.Generator) -> np.ndarray:
    """Draw a displacement [V, 3] without a scale, with features of WAVELENGTHS_MM."""
    points = 1000 * template.load().vertices
    mirrored = points * [-1, 1, 1]

    def field(at: np.ndarray, seed: int) -> np.ndarray:
        rngs = [np.random.default_rng([seed, axis]) for axis in range(3)]
        return np.stack([octaves(at, WAVELENGTHS_MM, rng, smooth=True) for rng in rngs], 1)

    even, odd = rng.integers(2**31, size=2)
    symmetric = field(points, even) + field(mirrored, even) * [-1, 1, 1]
    asymmetric = field(points, odd) - field(mirrored, odd) * [-1, 1, 1]
    return (symmetric + ASYMMETRY * asymmetric).astype(np.float64)


def _from_facekit(folder: Path, rng: np.random.Generator) -> np.ndarray:
    """Draw a combination [V, 3] of ICT-FaceKit's identities, weighted anew on each side of the face."""
    shapes = fields(folder)
    side = np.tanh(template.load().vertices[:, 0] / 0.03)[None, :, None]
    even, odd = rng.normal(size=(2, len(shapes), 1, 1))
    return ((even + ASYMMETRY * odd * side) * shapes).sum(0)
