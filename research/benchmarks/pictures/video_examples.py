# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw the guide's pictures of good and bad videos, made with the synthetic subject.

    python -m research.benchmarks.pictures.video_examples docs/pictures

docs/pictures/film_good.jpg: five frames of one arc from ear to ear. docs/pictures/film_bad.jpg: moved too fast, from
too far, too near, a bare background, burnt out, too dark.
"""

import tempfile
from pathlib import Path

import numpy as np

from core.imaging import images

from ...people import scene
from ...people.parameters import sample_parameters
from ...people.sample import MAPS, RESERVED, render_frames
from ...people.skin import make_skin
from ..figures import command_line

SCALE, SAMPLES = 0.4, 24
SWING_DEG, BLUR = 4.0, 9
"""Degrees that a hasty hand turns around the head while one frame is exposed, and the pictures averaged for it."""


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    seed = RESERVED["sample"]
    skin = make_skin(sample_parameters(seed), MAPS)
    with tempfile.TemporaryDirectory() as work:

        def shots(name: str, cameras: np.ndarray, room: bool = True) -> list[np.ndarray]:
            """Linear pictures through camera-to-world matrices [N, 4, 4]."""
            render_frames(
                Path(work) / name,
                seed,
                skin,
                scene.Shot(cameras, list(range(len(cameras))), SAMPLES, SCALE, room=room),
                leaves=False,
            )
            return [images.read_linear(Path(work) / name / f"{k:05d}.png") for k in range(len(cameras))]

        good = shots(
            "good", np.stack([around(azimuth, 6 + 8 * np.sin(azimuth / 20)) for azimuth in (-60, -30, 0, 30, 60)])
        )
        hasty = np.mean(shots("hasty", np.stack([around(-12 + a, 6) for a in np.linspace(0, SWING_DEG, BLUR)])), axis=0)
        far, near = shots("far", np.stack([around(0, 6, 1.7), around(0, 6, 0.24)]))
        (bare,) = shots("bare", around(0, 6)[None], room=False)
    noise = np.random.default_rng(0).normal(scale=0.006, size=good[2].shape)
    burnt, dark = np.minimum(4 * good[2], 1), np.maximum(0.04 * good[2] + noise, 0)
    for name, row in (("film_good", good), ("film_bad", [hasty, far, near, bare, burnt, dark])):
        images.write_srgb(
            folder / f"{name}.jpg",
            np.hstack([images.linear_to_srgb(picture.astype(np.float32)) for picture in row]),
            quality=85,
        )


def around(azimuth_deg: float, height_deg: float, distance: float = scene.DISTANCE) -> np.ndarray:
    """Return a camera-to-world matrix [4, 4] around the head, upright; azimuth 0 is in front, positive to its left."""
    azimuth, height = np.radians(azimuth_deg), np.radians(height_deg)
    back = np.array([np.sin(azimuth) * np.cos(height), -np.cos(azimuth) * np.cos(height), np.sin(height)])
    right = np.cross([0, 0, 1.0], back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = right, np.cross(back, right), back
    matrix[:3, 3] = distance * back + [0, -0.01, -0.035]
    return matrix


if __name__ == "__main__":
    main()
