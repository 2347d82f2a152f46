# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Find which way hair lies on the skin: along the strokes of the albedo, from root to tip as such hair grows.

The strokes are found by the structure tensor of the albedo's fine detail (Bigun and Granlund 1987) in the tangent
plane.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ...geometry import raster
from ...geometry.meshes import vertex_normals
from ...geometry.views import lengths
from ...imaging import images
from .surface import HeadSurface

COARSEST_MM = 0.7  # smoother detail is skin, or the edge of a brow, and no stroke
AROUND_MM = 1.5  # over which neighbouring hairs lie alike, and their strokes are taken together


@dataclass(frozen=True)
class HairTexels:
    """N texels on which hair grows, row by row: mask bool [S, S]; position [N, 3] in mm; unit vectors [N, 3]."""

    mask: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    tangent: np.ndarray
    bitangent: np.ndarray

    def flatten(self, vectors: np.ndarray) -> np.ndarray:
        """Return vectors [N, 3] in the tangent plane, [N, 2] along tangent and bitangent, unit."""
        flat = np.stack([(vectors * self.tangent).sum(1), (vectors * self.bitangent).sum(1)], 1)
        return flat / np.maximum(lengths(flat), 1e-9)[:, None]

    def raise_up(self, flat: np.ndarray, index: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Return [M, 2] of the tangent planes at the texels of `index` as vectors [M, 3] along the skin."""
        return flat[:, :1] * self.tangent[index] + flat[:, 1:] * self.bitangent[index]


def lay_texels(surface: HeadSurface, mask: np.ndarray) -> HairTexels:
    """Return the texels of `mask` bool [S, S], all of them on the head."""
    tangent, bitangent = surface.frames(mask)
    mesh, position = surface.mesh, surface.position[mask].astype(np.float64)
    normal = raster.interpolate(vertex_normals(mesh), mesh.faces, surface.face[mask], surface.bary[mask])
    return HairTexels(mask, position, normal / lengths(normal)[:, None], tangent, bitangent)


def measure_tensors(albedo: np.ndarray, texels: HairTexels, texel: float) -> np.ndarray:
    """Return tensors [N, 2, 2] of trace 1, large across a linear albedo's strokes, small along them; `texel` in mm."""
    grey = images.linear_to_srgb(albedo).mean(2)
    fine = cv2.GaussianBlur(grey - cv2.GaussianBlur(grey, (0, 0), COARSEST_MM / texel), (0, 0), 0.7)
    right, down = (cv2.Scharr(fine, cv2.CV_32F, *axis, scale=1 / 32) for axis in ((1, 0), (0, 1)))
    slopes = np.where(texels.mask[..., None], np.stack([right, -down], -1), 0)  # the bitangent points up the map
    products = (slopes[..., :, None] * slopes[..., None, :]).reshape(*grey.shape, 4)
    tensors = cv2.GaussianBlur(products, (0, 0), AROUND_MM / texel)[texels.mask].reshape(-1, 2, 2).astype(np.float64)
    return tensors / np.maximum(np.trace(tensors, axis1=1, axis2=2), 1e-12)[:, None, None]


def choose_ways(tensors: np.ndarray, texels: HairTexels, usual: np.ndarray, trust: float) -> np.ndarray:
    """Return unit directions [N, 3] along the skin from root to tip.

    tensors [N, 2, 2] are the strokes'. `usual` [N, 3] is how such hair grows: it separates root from tip, and counts as
    strokes of the coherence `trust`.
    """
    usual = texels.flatten(usual)
    across = np.stack([-usual[:, 1], usual[:, 0]], 1)
    along = np.linalg.eigh(tensors + trust * across[:, :, None] * across[:, None])[1][..., 0]
    return texels.raise_up(along * np.where((along * usual).sum(1) < 0, -1, 1)[:, None])
