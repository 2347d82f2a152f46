# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The maps of a head as arrays: what the steps of this room hand on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..contract.messages import Problem
from ..contract.stages import advise_again
from ..imaging import images


@dataclass(frozen=True)
class HeadMaps:
    """All float32 on S x S texels. diffuse [S, S, 3]: albedo, linear sRGB; normal [S, S, 3]: unit, tangent space,
    OpenGL Y+; specular [S, S]: Principled BSDF's Specular IOR Level; confidence [S, S] in [0, 1]; shading [S, S, 3]:
    linear, albedo x shading = texture."""

    diffuse: np.ndarray
    normal: np.ndarray
    specular: np.ndarray
    confidence: np.ndarray
    shading: np.ndarray


def read_maps(folder: Path) -> HeadMaps:
    """The maps that the solver wrote. Raises Problem where one is damaged or of another size than the others."""
    paths = {"diffuse": folder / "diffuse_albedo.exr", "normal": folder / "normal.png",
             "specular": folder / "specular_albedo.png",
             "confidence": folder / "confidence.png", "shading": folder / "shading.exr"}
    normal = images.read_normals(paths["normal"])
    maps = HeadMaps(images.read_linear(paths["diffuse"]),
                    normal / np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-6),
                    images.read_mask(paths["specular"]), images.read_mask(paths["confidence"]),
                    images.read_linear(paths["shading"]))
    side = len(maps.diffuse)
    for name, pixels in vars(maps).items():
        if pixels.shape[:2] != (side, side):
            raise Problem(f"{paths[name]} is {pixels.shape[1]} x {pixels.shape[0]} pixels, but {paths['diffuse'].name} "
                          f"is {maps.diffuse.shape[1]} x {side}.",
                          advise_again("solve"))
    return maps
