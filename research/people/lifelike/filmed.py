# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear frames of a person, rendered by Cycles."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from core.capture.files import replacing
from core.face.strands import Strands

from .. import scene
from ..rendering import render_parts, write_part, write_skin
from .figure import Figure


def render(work: Path, figure: Figure, light: scene.SceneLight, shot: scene.Shot, bare: bool = False) -> None:
    """Render a person to work/NNNNN.exr, linear; existing files stay. bare: without hair, lashes and clothes."""
    skin, albedo = figure.skin, figure.skin.diffuse if bare else figure.seen
    parts = {"skin": write_skin(work, figure.opened.skin, albedo, skin.specular, skin.normal)}
    for side, ball in zip(("left", "right"), figure.opened.balls, strict=True):
        parts[f"{side}_eye"] = write_part(work, f"{side}_eye", ball.mesh, "eyes", figure.eye)
    strands = []
    if not bare:
        cloth = np.full((2, 2, 3), figure.person.clothes, np.float32)
        parts["shirt"] = write_part(work, "shirt", figure.shirt, "cloth", cloth)
        strands = [_write_strands(work, growth) for growth in figure.strands]
    render_parts(work, figure.person.seed, parts, strands, light, shot)


def _write_strands(work: Path, growth: Strands) -> Path:
    path = work / f"strands_{growth.part}.npz"
    with replacing(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, points=growth.points, radius=growth.taper(), colour=growth.colour)
    return path
