# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Texel grid lighting model Gamma_theta (paper, section 3.3, equations 2 to 4).

A global light gamma^g of second-order spherical harmonics shades the face, and a grid V of local ones inside the shadow
mask M:

    gamma^V = interp(u, v; V)                                    equation 2, `Shader._read`
    gamma = gamma^g + gamma^V M                                  equation 3, `Shader.total`
    c = a / pi sum_lm B_l gamma_lm Y_lm(n) = a * shading         equation 4, `shading_basis`

Shading is linear. B_l, 1 / pi and the scale of Y_lm are one constant per band: `spherical_harmonics.GAMMA_BANDS`, those
of the authors' code.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np
import torch

from ..light.spherical_harmonics import GAMMA_BANDS, sh_basis


class OnDevice:
    """Base of objects that hold tensors, or lists or other such objects of them."""

    def to(self, device: torch.device | str):
        """Return a copy whose tensors are on a device."""
        moved = copy.copy(self)
        vars(moved).update({name: _move(value, device) for name, value in vars(self).items()})
        return moved


def _move(value, device: torch.device | str):
    if isinstance(value, list):
        return [_move(each, device) for each in value]
    return value.to(device) if isinstance(value, torch.Tensor | OnDevice) else value


def shading_basis(normal: torch.Tensor) -> torch.Tensor:
    """Return B_l Y_lm / pi of normals [3, ...], of any length, as [9, ...]."""
    return sh_basis(normal, GAMMA_BANDS, axis=0)


def shade(gamma: torch.Tensor, basis: torch.Tensor) -> torch.Tensor:
    """Return the shading [3, H, W] of one light [3, 9] on a `shading_basis` [9, H, W]."""
    return torch.einsum("ck,khw->chw", gamma, basis)


@dataclass
class Lights(OnDevice):
    """theta, the parameters of Gamma, all float32.

    glob: gamma^g [3, 9]. grid: V [G, 9, h, w] with G = 3 colours, or G = 1 if one learned `chroma` [3] colours all
    local light: where the sun is blocked, light of one chromaticity is missing.
    """

    glob: torch.Tensor
    grid: torch.Tensor
    chroma: torch.Tensor

    def parameters(self) -> list[torch.Tensor]:
        return [self.glob, self.grid, self.chroma]


class Shader(OnDevice):
    """Gamma_theta of one map: the fixed parts of every texel's shading, prepared once.

    normal [3, H, W], alpha [H, W] the soft shadow mask M, cells (h, w) of the grid. The grid covers the map edge to
    edge and is read by a cubic kernel, or a bilinear one. Local light exists only inside M, so all of it is computed on
    `box`, the bounding box of M and three texels around it, which L_TV's differences on the ring need.
    """

    def __init__(self, normal: torch.Tensor, alpha: torch.Tensor, cells: tuple[int, int], bilinear: bool = False):
        self.basis = shading_basis(normal)  # [9, H, W]
        self.normal, self.alpha, self.cells, self.bilinear = normal, alpha, cells, bilinear
        inside = torch.nonzero(alpha > 0)  # [N, 2]
        self.empty = len(inside) == 0
        first, end = [0, 0], [1, 1]
        if not self.empty:
            first, end = (inside.amin(0) - 3).tolist(), (inside.amax(0) + 4).tolist()
        self.box = tuple(slice(max(a, 0), min(b, size)) for a, b, size in zip(first, end, alpha.shape, strict=True))
        up = [interpolation_matrix(c, size, bilinear).to(normal) for c, size in zip(cells, alpha.shape, strict=True)]
        self.up_rows, self.up_columns = up[0][self.box[0]], up[1][self.box[1]]  # [h', h], [w', w]
        self.box_basis, self.box_alpha = self.basis[(slice(None), *self.box)], alpha[self.box]

    def part(self, rows: slice, columns: slice, cells: tuple[slice, slice]) -> Shader:
        """Return the shader of a part of the map, whose own grid is these cells of V."""
        count = tuple(span.stop - span.start for span in cells)
        return Shader(self.normal[:, rows, columns], self.alpha[rows, columns], count, self.bilinear)

    def main(self, lights: Lights) -> torch.Tensor:
        """Return the shading by the global light [3, H, W]."""
        return shade(lights.glob, self.basis)

    def local(self, lights: Lights) -> torch.Tensor:
        """Return s^V, the shading by the grid alone, modulated by M, on `box` [3, h', w']."""
        return self.unmodulated(lights) * self.box_alpha

    def unmodulated(self, lights: Lights) -> torch.Tensor:
        """Return the shading by the grid alone as if M were everywhere, on `box` [3, h', w']."""
        scalar = (self._read(lights) * self.box_basis).sum(1)  # [G, h', w']
        return scalar * lights.chroma[:, None, None] if len(scalar) == 1 else scalar

    def coefficients(self, lights: Lights) -> torch.Tensor:
        """Return gamma^V M of every texel of `box` [G, 9, h', w']: what gamma is beyond gamma^g."""
        return self._read(lights) * self.box_alpha

    def _read(self, lights: Lights) -> torch.Tensor:
        return self.up_rows @ lights.grid @ self.up_columns.T

    def total(self, lights: Lights) -> torch.Tensor:
        """Return the shading [3, H, W] by both lights."""
        shading = self.main(lights)
        if not self.empty:
            shading[(slice(None), *self.box)] += self.local(lights)
        return shading


def interpolation_matrix(cells: int, texels: int, bilinear: bool = False) -> torch.Tensor:
    """Return the matrix [texels, cells] that resamples a line by the cubic kernel (a = -0.5) or the linear one.

    Centres are at half pixels and borders repeat. To shrink, the kernel widens with the step (antialiasing).
    """
    step = cells / texels
    wide = max(step, 1.0)
    centres = (np.arange(texels) + 0.5) * step - 0.5
    first = np.floor(centres - 2 * wide).astype(int)
    index = first[:, None] + np.arange(int(np.ceil(4 * wide)) + 2)  # [texels, taps]
    weight = (_linear if bilinear else _cubic)((index - centres[:, None]) / wide)
    weight /= weight.sum(1, keepdims=True)
    mirrored = np.mod(index, 2 * cells)
    mirrored = np.where(mirrored < cells, mirrored, 2 * cells - 1 - mirrored)
    matrix = np.zeros((texels, cells))
    np.add.at(matrix, (np.arange(texels)[:, None].repeat(index.shape[1], 1), mirrored), weight)
    return torch.from_numpy(matrix).float()


def _linear(t: np.ndarray) -> np.ndarray:
    return np.maximum(1 - np.abs(t), 0)


def _cubic(t: np.ndarray) -> np.ndarray:
    t = np.abs(t)
    return np.where(t <= 1, 1.5 * t**3 - 2.5 * t**2 + 1, np.where(t < 2, -0.5 * t**3 + 2.5 * t**2 - 4 * t + 2, 0.0))


def fit_global(
    texture: torch.Tensor, albedo: torch.Tensor, basis: torch.Tensor, weight: torch.Tensor, ridge: float = 1e-3
) -> torch.Tensor:
    """Return the gamma^g [3, 9] that minimises sum weight^2 (texture - albedo * shading)^2, in closed form.

    Texture and albedo are [3, H, W] linear, basis [9, H, W], weight [H, W]. The ridge, in units of the mean diagonal,
    keeps coefficients that no normal sees at zero.
    """
    exact = torch.float32 if basis.device.type == "mps" else torch.float64  # Apple's GPUs have no float64
    columns = basis.reshape(9, -1).to(exact)
    w2 = weight.reshape(-1).to(exact) ** 2
    out = []
    for t, a in zip(texture.reshape(3, -1).to(exact), albedo.reshape(3, -1).to(exact), strict=True):
        normal_matrix = (columns * (w2 * a * a)) @ columns.T
        identity = torch.eye(9, dtype=exact, device=basis.device)
        damping = ridge * normal_matrix.diagonal().mean().clamp_min(1e-12) * identity
        # `solve` would ask the device whether it went well
        out.append(torch.linalg.solve_ex(normal_matrix + damping, (columns * (w2 * a)) @ t)[0])
    return torch.stack(out).float()


def fit_around(
    even: torch.Tensor,
    texture: torch.Tensor,
    albedo: torch.Tensor,
    basis: torch.Tensor,
    weight: torch.Tensor,
    ridge: float,
) -> torch.Tensor:
    """Return `fit_global`'s light, but with coefficients drawn to the light `even` [3, 9] instead of to zero."""
    return even + fit_global(texture - albedo * shade(even, basis), albedo, basis, weight, ridge)


def fit_around_constant(
    texture: torch.Tensor, albedo: torch.Tensor, basis: torch.Tensor, weight: torch.Tensor, ridge: float
) -> torch.Tensor:
    """Return `fit_around` the even light that gives the texture's mean colour."""
    total = weight.sum().clamp_min(1e-6)
    even = constant_light((texture * weight).sum((1, 2)) / (albedo * weight).sum((1, 2)).clamp_min(1e-4 * total))
    return fit_around(even, texture, albedo, basis, weight, ridge)


def constant_light(shading: torch.Tensor) -> torch.Tensor:
    """Return the gamma^g [3, 9] that shades every normal by `shading` [3]."""
    glob = shading.new_zeros(3, 9)
    glob[:, 0] = shading / GAMMA_BANDS[0]
    return glob
