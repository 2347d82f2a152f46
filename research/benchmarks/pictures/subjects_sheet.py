# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw the guide's picture of many faces: the eight reserved synthetic subjects, each in a room of its own.

python -m research.benchmarks.pictures.subjects_sheet docs/pictures/subjects.jpg
"""

import tempfile
from pathlib import Path

import numpy as np

from core.imaging import images

from ...people import scene
from ...people.parameters import sample_parameters
from ...people.sample import render_frames
from ...people.skin import make_skin
from ..figures import command_line
from .sheet import in_rows, write_small
from .video_examples import around

SUBJECTS = tuple(range(900001, 900009))
COLUMNS, SIDE = 4, 360
MAPS, SAMPLES = 1024, 24
"""Texels along a side of the subjects' maps, enough for a face of 250 pixels, and rays per pixel."""


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("out", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as work:
        pictures = [portrait(seed, Path(work) / str(seed)) for seed in SUBJECTS]
    write_small(options.out, in_rows(pictures, COLUMNS))


def portrait(seed: int, work: Path) -> np.ndarray:
    """Return a subject in its room, sRGB [SIDE, SIDE, 3]; `work` takes the render."""
    shot = scene.Shot(around(-22, 6, 0.52)[None], [0], SAMPLES, SIDE / scene.WIDTH)
    render_frames(work, seed, make_skin(sample_parameters(seed), MAPS), shot, leaves=False)
    picture = images.read_srgb(work / "00000.png")[..., :3]
    top = (len(picture) - SIDE) // 2
    return picture[top : top + SIDE]


if __name__ == "__main__":
    main()
