# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A contact sheet of subjects, for looking at: python -m research.people.sheet OUT.jpg [SEED ...]"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from core.imaging import images

from . import scene
from .parameters import sample_parameters
from .sample import render_frames
from .skin import make_skin

SEEDS = (11, 12, 13, 14, 15, 16, 17, 18)
COLUMNS = 4


def main() -> None:
    out, seeds = Path(sys.argv[1]), [int(seed) for seed in sys.argv[2:]] or SEEDS
    with tempfile.TemporaryDirectory(prefix="wildcap_sheet_") as folder:
        tiles = [portrait(seed, Path(folder) / str(seed)) for seed in seeds]
    rows = [np.concatenate(tiles[k : k + COLUMNS], 1) for k in range(0, len(tiles), COLUMNS)]
    images.write_srgb(out, np.concatenate(rows))


def portrait(seed: int, work: Path, scale: float = 0.5) -> np.ndarray:
    """A subject in sun and sky from a little to one side: sRGB [h, w, 3]."""
    camera = np.eye(4)
    angle = np.radians(18)
    towards = np.array([np.sin(angle), -np.cos(angle), 0.12])
    back = towards / np.linalg.norm(towards)
    right = np.cross([0, 0, 1.0], back)
    right /= np.linalg.norm(right)
    camera[:3, 0], camera[:3, 1], camera[:3, 2], camera[:3, 3] = (
        right,
        np.cross(back, right),
        back,
        scene.DISTANCE * 1.05 * back + [0, 0, -0.02],
    )
    render_frames(
        work, seed, make_skin(sample_parameters(seed), 1024), scene.Shot(camera[None], [0], 24, scale), leaves=False
    )
    picture = images.read_srgb(work / "00000.png")
    return picture[picture.shape[0] // 12 : -picture.shape[0] // 6]


if __name__ == "__main__":
    main()
