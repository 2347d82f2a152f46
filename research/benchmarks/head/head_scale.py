# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the error of the distance between the pupils, on synthetic heads of known size.

    python -m research.benchmarks.head.head_scale [SEED ...]

Synthetic heads of known size, photographed by known cameras; printed is by how much too large each comes out and how
far it leans, which is what PUPILS_PER_LIDS in core/stages/cameras/landmarks.py was set by (its 1.019 divides out; the
heads it was set on are the default seeds).
"""

import numpy as np

from core.face import faces
from core.stages.cameras.landmarks import PUPILS_PER_LIDS, fit_rays, pupils
from core.stages.cameras.world import intersect_rays

from ...people import painted_head
from ...people.identities import identity_coefficients
from ..figures import command_line

SEEDS = (5, 11, 23, 31, 42, 57)
AZIMUTHS = (-40, -28, -18, -9, 0, 9, 18, 28, 40)
TEMPLATE_PUPILS_PER_LIDS = 63.0 / 62.156


def measure(seed: int) -> tuple[float, float]:
    """Return the error of the distance of the pupils in percent, and how far the head leans back in degrees."""
    right, left = pupils(identity_coefficients(seed))
    true = np.linalg.norm(left - right) / PUPILS_PER_LIDS * TEMPLATE_PUPILS_PER_LIDS
    origins, directions = [], []
    for azimuth in AZIMUTHS:
        view = painted_head.place_camera(azimuth, 0.05 * np.sin(azimuth), scale=1.2)
        face = faces.detect(painted_head.photograph(view, seed=seed, texels=512))
        if face is not None:
            origins.append(view.centre)
            directions.append(view.rays(face.landmarks[:, :2]))
    origins, directions = np.array(origins), np.array(directions)
    scale, rotation, _, coefficients = fit_rays(origins, directions, intersect_rays(origins, directions)[0])
    right, left = pupils(coefficients)
    larger = scale * np.linalg.norm(left - right) / true - 1
    return 100 * larger, float(np.degrees(np.arctan2(rotation[1, 2], rotation[2, 2])))


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("seeds", type=int, nargs="*", default=SEEDS)
    errors = []
    for seed in parser.parse_args().seeds:
        error, lean = measure(seed)
        errors.append(error)
        print(f"subject {seed:4}   pupils {error:+5.1f} %   leans back {lean:+5.1f} degrees", flush=True)
    print(f"median {np.median(errors):+.1f} %, mean {np.mean(errors):+.1f} %, worst {max(errors, key=abs):+.1f} %")


if __name__ == "__main__":
    main()
