# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes photographs/ beside this file, of a synthetic person whose eyes are open, for the flow of the same name:

    python tests/gui/photographed.py [FOLDER]

Seven photographs from one side of the face to the other, path-traced by Cycles in soft daylight before a cluttered
room; minutes on two cores. They are kept in the repository, since a window test has no minutes to spare.
"""

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np  # noqa: E402

from core.imaging import images  # noqa: E402
from research.people import scene  # noqa: E402
from research.people.lifelike import filmed  # noqa: E402
from research.people.lifelike.figure import make_figure  # noqa: E402
from research.people.lifelike.person import Person, sample_person  # noqa: E402

FIRST_SEED = 930001
AZIMUTHS, HEIGHTS = (-54, -36, -18, 0, 18, 36, 54), (4, 10, 2, 8, 3, 11, 5)
"""Degrees: 0 is before the face."""
SCALE, SAMPLES = 0.75, 6
WINDOW = scene.AreaLamp((-1.1, -1.0, 0.6), 0.9, 28.0, (1.0, 0.97, 0.92))


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).with_name("photographs"))
    folder.mkdir(parents=True, exist_ok=True)
    light = scene.SceneLight((0.42, 0.42, 0.42), lamps=(WINDOW,))
    with tempfile.TemporaryDirectory() as work:
        filmed.render(
            Path(work), make_figure(somebody()), light, scene.Shot(cameras(), range(len(AZIMUTHS)), SAMPLES, SCALE)
        )
        linear = [images.read_linear(Path(work) / f"{k:05d}.exr")[..., :3] for k in range(len(AZIMUTHS))]
    gain = 0.75 / np.percentile(linear[len(linear) // 2], 95)
    for k, picture in enumerate(linear):
        images.write_srgb(
            folder / f"{k + 1:04d}.jpg",
            images.linear_to_srgb(np.clip(gain * picture, 0, 1).astype(np.float32)),
            quality=90,
        )


def somebody() -> Person:
    """The first person from FIRST_SEED on with open eyes, short hair, no fringe and no beard."""
    people = (sample_person(seed) for seed in range(FIRST_SEED, FIRST_SEED + 1000))
    return next(
        one for one in people if one.openness > 0.5 and one.hair == "short" and not one.fringe and one.beard == "none"
    )


def cameras() -> np.ndarray:
    """Camera-to-world matrices [N, 4, 4]."""
    azimuth, height = np.radians(AZIMUTHS), np.radians(HEIGHTS)
    direction = np.stack([np.sin(azimuth) * np.cos(height), -np.cos(azimuth) * np.cos(height), np.sin(height)], -1)
    position = scene.DISTANCE * direction
    target = np.broadcast_to([0, -0.01, -0.035], position.shape)
    return scene.looking(position + target, target, np.radians([1.0, -2.0, 1.5, 0.0, -1.0, 2.0, -1.5]))


if __name__ == "__main__":
    main()
