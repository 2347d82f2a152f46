# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A contact sheet of people: front, three-quarter, an eye and its brow, and the bare skin below hair and clothes."""

import time
from pathlib import Path

import numpy as np

from core.imaging import images

from ...people import scene
from ...people.lifelike import filmed
from ...people.lifelike.figure import Figure, make_figure
from .sheet import square

SIDE, SAMPLES, SCALE = 290, 12, 0.5
SUN = np.array([0.55, -0.70, 0.46])
SKY = (0.50, 0.54, 0.60)
SHOTS = (  # azimuth, height in degrees, distance and the point looked at in metres, factor on the focal length, bare
    (4.0, 2.0, 0.75, (0.0, 0.02, -0.03), 1.55, False),
    (40.0, 6.0, 0.75, (0.0, 0.03, -0.03), 1.55, False),
    (14.0, 0.0, 0.55, (0.030, -0.015, 0.006), 4.5, False),
    (22.0, 3.0, 0.75, (0.0, 0.02, -0.03), 1.55, True),
)


def write_sheet(out: Path, seeds: list[int], work: Path, facekit: Path | None = None) -> None:
    """Draw a row for each person; renders in the folder `work` are not made again."""
    rows = []
    for seed in seeds:
        began = time.monotonic()
        rows.append(np.concatenate(_shots(make_figure(seed, facekit=facekit), work / str(seed)), 1))
        print(f"{seed}: {(time.monotonic() - began) / 60:.1f} min", flush=True)
    images.write_srgb(out, np.concatenate(rows), quality=82)


def _shots(figure: Figure, work: Path) -> list[np.ndarray]:
    light, shots = scene.SceneLight(SKY, scene.Sun(SUN / np.linalg.norm(SUN), 2.0, 0.06)), []
    for k, (azimuth, height, distance, target, focal, bare) in enumerate(SHOTS):
        a, h = np.radians([azimuth, height])
        at = np.array(target) + distance * np.array([np.sin(a) * np.cos(h), -np.cos(a) * np.cos(h), np.sin(h)])
        folder = work / str(k)
        camera = scene.looking(at[None], np.array([target]), np.zeros(1))
        filmed.render(folder, figure, light, scene.Shot(camera, [0], SAMPLES, SCALE, room=False, focal=focal), bare)
        shots.append(square(images.linear_to_srgb(np.clip(images.read_linear(folder / "00000.exr"), 0, 1)), SIDE))
    return shots
