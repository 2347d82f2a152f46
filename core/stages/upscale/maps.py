# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Read the maps of a head as arrays, which the steps of this stage hand on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...capture.messages import Problem
from ...capture.stages import advise_again
from ...imaging import images


@dataclass(frozen=True)
class HeadMaps:
    """Maps of a head, float32 on S x S texels.

    diffuse [S, S, 3]: albedo, linear sRGB; normal [S, S, 3]: unit, tangent space, OpenGL Y+; specular [S, S]:
    Principled BSDF's Specular IOR Level; confidence [S, S] in [0, 1]: of the albedo; shading [S, S, 3]: linear, albedo
    x shading = texture; seen [S, S] in [0, 1]: how well the cameras saw a texel: a dark beard is seen well and has
    little confidence.
    """

    diffuse: np.ndarray
    normal: np.ndarray
    specular: np.ndarray
    confidence: np.ndarray
    shading: np.ndarray
    seen: np.ndarray


def read_maps(folder: Path, texture_confidence: Path) -> HeadMaps:
    """Read the solver's maps, and how well the texture saw each texel: not at all without confidence.

    Raises Problem if a map is damaged or of another size than the others.
    """
    paths = {
        "diffuse": folder / "diffuse_albedo.exr",
        "normal": folder / "normal.png",
        "specular": folder / "specular_albedo.png",
        "confidence": folder / "confidence.png",
        "shading": folder / "shading.exr",
    }
    normal = images.read_normals(paths["normal"])
    confidence = images.read_mask(paths["confidence"])
    maps = HeadMaps(
        images.read_linear(paths["diffuse"]),
        normal / np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-6),
        images.read_mask(paths["specular"]),
        confidence,
        images.read_linear(paths["shading"]),
        images.read_data(texture_confidence)[..., 0] if texture_confidence.is_file() else confidence,
    )
    side = len(maps.diffuse)
    for name, pixels in vars(maps).items():
        if name in paths and pixels.shape[:2] != (side, side):
            raise Problem(
                f"{paths[name]} is {pixels.shape[1]} x {pixels.shape[0]} pixels, but {paths['diffuse'].name} "
                f"is {maps.diffuse.shape[1]} x {side}.",
                advise_again("solve"),
            )
    return replace(maps, seen=images.resize(maps.seen, side, side).clip(0, 1) * (maps.confidence > 0))
