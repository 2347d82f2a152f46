# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which way hair lies on the skin: along the strokes that the albedo has from the frames, which way along them by how
such hair grows.

By the structure tensor of the albedo's fine detail (Bigun and Granlund 1987) in the tangent plane.
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

COARSEST_MM = 0.7
"""mm: what is smoother than that is skin, or the edge of a brow, and no stroke."""
AROUND_MM = 1.5
"""mm over which neighbouring hairs lie alike, and their strokes are taken together."""


@dataclass(frozen=True)
class HairTexels:
    """The N texels on which hair grows. mask bool [S, S]; position [N, 3] mm, normal, tangent and bitangent [N, 3]
    unit, row by row."""

    mask: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    tangent: np.ndarray
    bitangent: np.ndarray

    def flatten(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors [N, 3] in the tangent plane, [N, 2] along tangent and bitangent, unit."""
        flat = np.stack([(vectors * self.tangent).sum(1), (vectors * self.bitangent).sum(1)], 1)
        return flat / np.maximum(lengths(flat), 1e-9)[:, None]

    def raise_up(self, flat: np.ndarray, index: np.ndarray | slice = slice(None)) -> np.ndarray:
        """The contrary, at the texels of `index`: [M, 2] to vectors [M, 3] along the skin."""
        return flat[:, :1] * self.tangent[index] + flat[:, 1:] * self.bitangent[index]


def lay_texels(surface: HeadSurface, mask: np.ndarray) -> HairTexels:
    """The texels of `mask` bool [S, S], all of them on the head."""
    tangent, bitangent = surface.frames(mask)
    normal = raster.interpolate(
        vertex_normals(surface.mesh), surface.mesh.faces, surface.face[mask], surface.bary[mask]
    )
    return HairTexels(
        mask, surface.position[mask].astype(np.float64), normal / lengths(normal)[:, None], tangent, bitangent
    )


def measure_tensors(albedo: np.ndarray, texels: HairTexels, texel: float) -> np.ndarray:
    """Structure tensors [N, 2, 2] of the strokes of a linear albedo [S, S, 3] in the tangent plane, of trace 1 (0 where
    nothing is seen), over AROUND_MM: large across the strokes, small along them. texel: its width in mm."""
    grey = images.linear_to_srgb(albedo).mean(2)
    fine = cv2.GaussianBlur(grey - cv2.GaussianBlur(grey, (0, 0), COARSEST_MM / texel), (0, 0), 0.7)
    right, down = (cv2.Scharr(fine, cv2.CV_32F, *axis, scale=1 / 32) for axis in ((1, 0), (0, 1)))
    slopes = np.where(texels.mask[..., None], np.stack([right, -down], -1), 0)  # the bitangent points up the map
    products = (slopes[..., :, None] * slopes[..., None, :]).reshape(*grey.shape, 4)
    tensors = cv2.GaussianBlur(products, (0, 0), AROUND_MM / texel)[texels.mask].reshape(-1, 2, 2).astype(np.float64)
    return tensors / np.maximum(np.trace(tensors, axis1=1, axis2=2), 1e-12)[:, None, None]


def choose_ways(tensors: np.ndarray, texels: HairTexels, usual: np.ndarray, trust: float) -> np.ndarray:
    """How hairs lie along the skin.

    Parameters
    ----------
    tensors : [N, 2, 2], of the strokes at the texels
    texels : the N texels
    usual : [N, 3], how such hair grows: tells root from tip, and the direction where strokes tell none
    trust : the usual direction counts as strokes of this coherence

    Returns
    -------
    Unit directions from root to tip [N, 3].
    """
    usual = texels.flatten(usual)
    across = np.stack([-usual[:, 1], usual[:, 0]], 1)
    along = np.linalg.eigh(tensors + trust * across[:, :, None] * across[:, None])[1][..., 0]
    return texels.raise_up(along * np.where((along * usual).sum(1) < 0, -1, 1)[:, None])
