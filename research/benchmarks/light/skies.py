# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the statistics of environments and facial skin behind the prior of core/light/sunlight.py.

    python -m research.benchmarks.light.skies FOLDER

FOLDER holds panoramas (.hdr, .exr), +Z up. Their sun or lamp is taken out as for portraits, for the fit has a sun of
its own. Every panorama counts as if it were turned about the vertical by any angle.
"""

from pathlib import Path

import numpy as np

from core.capture.messages import Problem
from core.face import template
from core.face.head import Head
from core.light.spherical_harmonics import sh_basis
from core.solver.extensions.split import TRAIT_REACH_M
from core.stages.delight.surface import skin_weights

from ...people.environments import panorama_directions, read_panoramas, solid_angles, without_lamp
from ..figures import command_line

POINTS = 2500  # of the skin, drawn evenly
PAIRS = ((1, 3), (4, 8), (5, 7))
"""Harmonics that turn into each other about the vertical."""


def main() -> int:
    parser = command_line(__doc__)
    parser.add_argument("folder", type=Path)
    panoramas = read_panoramas(parser.parse_args().folder)
    if not panoramas:
        raise Problem("The folder holds no panoramas.", "Name one with .hdr or .exr files.")
    mean, deviation = summarise_skies(np.array([harmonic_shares(without_lamp(panorama)[0]) for panorama in panoramas]))
    print(f"{len(panoramas)} panoramas, shares of the first coefficient")
    print("mean     ", " ".join(f"{value:6.3f}" for value in mean))
    print("deviation", " ".join(f"{value:6.3f}" for value in deviation))
    mesh = template.load()
    weights, _ = skin_weights(Head(mesh))
    print(f"independent samples of bare facial skin: {count_independent(mesh.vertices, weights, TRAIT_REACH_M):.1f}")
    return 0


def harmonic_shares(panorama: np.ndarray) -> np.ndarray:
    """Return the coefficients [9] of a panorama's luminance [H, W, 3], as shares of the first."""
    size = panorama.shape[:2]
    coefficients = np.einsum("ijk,ij->k", sh_basis(panorama_directions(*size)), panorama.mean(-1) * solid_angles(*size))
    return coefficients / coefficients[0]


def summarise_skies(shares: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and deviation [9] of environments [N, 9] that may be turned about the vertical."""
    mean, square = np.zeros(9), (shares**2).mean(0)
    for pair in PAIRS:
        square[list(pair)] = square[list(pair)].mean()
    zonal = [0, 2, 6]
    mean[zonal] = shares[:, zonal].mean(0)
    return mean, np.sqrt(np.maximum(square - mean**2, 0))


def count_independent(points: np.ndarray, weights: np.ndarray, reach: float) -> float:
    """Return the number of independent samples among points [V, 3] with weights [V].

    Their values are correlated by exp(-distance / reach).
    """
    rows = np.flatnonzero(weights > 0)
    rows = rows[:: max(1, len(rows) // POINTS)]
    points, weights = points[rows], weights[rows]
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
    return float(weights.sum() ** 2 / (weights @ np.exp(-apart / reach) @ weights))


if __name__ == "__main__":
    raise SystemExit(main())
