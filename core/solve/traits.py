# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a global light may be believed: the large shapes in which a face differs from the reference are its own traits (cheeks, a beard, a tan), or light.

Light follows the normals, traits do not care for them. So what second-order lighting explains of these shapes is told beside what it leaves: where it leaves as
much as it explains, both are traits; where it explains several times of what it leaves, that is light. Brightness and colour are told apart, as a
lamp's colour shows on a face whose brightness varies by itself.
"""

from __future__ import annotations

import cv2
import numpy as np
import torch

from .lighting import fit_global, shading_basis

LARGE = 40.0  # deviation of the blur that leaves the large shapes, in texels of a 1024 map
TRAITS = 0.6  # variance that a light seems to explain, beside what it leaves, where all of it are traits; chosen as DELIT was
FINEST = 0.003  # deviation that every face leaves at least
LEAST = 0.2  # share of a blur's window that must be known


def held(texture: torch.Tensor, reference: torch.Tensor, normal: torch.Tensor, weight: torch.Tensor, texel: float) -> tuple[float, float]:
    """How far the global light is to be held to an even one, in brightness and in colour, each in [0, 1]: 1 where what it would explain may be traits.

    texture, reference albedo [3, S, S] linear, the texture's exposure being such that its shading is about one; normal [3, S, S]; weight [S, S]: how far
    a texel tells of light, 0 in shadows; `texel` is the side of one in texels of a 1024 map.
    """
    ratio = (texture.clamp_min(0.01) / reference.clamp_min(0.01)).log().permute(1, 2, 0).numpy()
    weight = weight.numpy()
    share = _blurred(weight, LARGE / texel)
    large = _blurred(weight[..., None] * ratio, LARGE / texel) / np.maximum(share, 1e-3)[..., None]
    counted = torch.from_numpy(weight * (share > LEAST))
    if counted.sum() < 1:
        return 1.0, 1.0
    brightness = large.mean(-1, keepdims=True)
    return _held(np.repeat(brightness, 3, -1), normal, counted), _held(large - brightness, normal, counted)


def _held(shapes: np.ndarray, normal: torch.Tensor, weight: torch.Tensor) -> float:
    """For shapes [S, S, 3], logarithms; the pull falls with the square of what is explained."""
    shapes, basis = torch.from_numpy(np.ascontiguousarray(shapes.transpose(2, 0, 1))), shading_basis(normal)
    fitted = torch.einsum("ck,khw->chw", fit_global(shapes, torch.ones_like(shapes), basis, weight.sqrt(), ridge=1e-3), basis)
    mean = (fitted * weight).sum((1, 2), keepdim=True) / weight.sum()
    explained, left = (float((weight * part**2).sum()) for part in (fitted - mean, shapes - fitted))
    return min(1.0, TRAITS * (left + 3 * float(weight.sum()) * FINEST**2) / max(explained, 1e-9)) ** 2


def _blurred(image: np.ndarray, sigma: float) -> np.ndarray:
    return cv2.GaussianBlur(image.astype(np.float32), (0, 0), sigma)
