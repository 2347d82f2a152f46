# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The light: second-order spherical harmonics for the whole face, and a texel grid of local ones inside the shadow mask
(paper, section 3.3).

Shading is linear and multiplies the albedo. Coefficients are those of the authors' code,
`spherical_harmonics.GAMMA_BANDS`.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np
import torch

from ..light.spherical_harmonics import GAMMA_BANDS, sh_basis


def shading_basis(normal: torch.Tensor) -> torch.Tensor:
    """Shading of each unit coefficient of gamma for normals [3, ...] -> [9, ...]; lengths other than one enter the
    polynomials as they are."""
    return sh_basis(normal, GAMMA_BANDS, axis=0)


@dataclass
class Lights:
    """theta: the parameters of Gamma, all float32.

    glob: gamma^g [3, 9]. grid: V [G, 9, h, w] with G = 3 colours, or G = 1 where one learned `chroma` [3] colours all
    local light: where the sun is blocked, light of one chromaticity is missing.
    """

    glob: torch.Tensor
    grid: torch.Tensor
    chroma: torch.Tensor

    def parameters(self) -> list[torch.Tensor]:
        return [self.glob, self.grid, self.chroma]

    def requires_grad_(self, requires_grad: bool) -> Lights:
        for parameter in self.parameters():
            parameter.requires_grad_(requires_grad)
        return self

    def to(self, device: torch.device | str) -> Lights:
        """The same lights on another device; these themselves where they are there."""
        return Lights(*(parameter.to(device) for parameter in self.parameters()))


class Shader:
    """Gamma_theta for one map: the fixed parts of the shading of every texel, prepared once.

    normal [3, H, W], alpha [H, W] the soft shadow mask M, cells (h, w) of the grid. The grid covers the map edge to
    edge and is read by a cubic kernel, or a bilinear one.
    """

    def __init__(self, normal: torch.Tensor, alpha: torch.Tensor, cells: tuple[int, int], bilinear: bool = False):
        self.basis = shading_basis(normal)  # [9, H, W]
        self.normal, self.alpha, self.cells, self.bilinear = normal, alpha, cells, bilinear
        height, width = alpha.shape
        rows, columns = (torch.nonzero(alpha.sum(1 - axis) > 0)[:, 0] for axis in (0, 1))
        self.empty = len(rows) == 0
        # local light exists only where M does: everything about it is computed on M's bounding box, one texel wider for
        # the ring's differences
        self.box = (
            (slice(0, 1), slice(0, 1))
            if self.empty
            else tuple(
                slice(max(int(i[0]) - 3, 0), min(int(i[-1]) + 4, size))
                for i, size in ((rows, height), (columns, width))
            )
        )
        self.up_rows = interpolation_matrix(cells[0], height, bilinear).to(normal)[self.box[0]]  # [h', h]
        self.up_columns = interpolation_matrix(cells[1], width, bilinear).to(normal)[self.box[1]]  # [w', w]
        self.box_basis = self.basis[(slice(None), *self.box)]
        self.box_alpha = alpha[self.box]

    def to(self, device: torch.device | str) -> Shader:
        """The same shader on another device."""
        moved = copy.copy(self)
        moved.__dict__.update(
            {name: value.to(device) for name, value in vars(self).items() if isinstance(value, torch.Tensor)}
        )
        return moved

    def part(self, rows: slice, columns: slice, cells: tuple[slice, slice]) -> Shader:
        """The shader of a part of the map, whose own grid are these cells of V."""
        count = tuple(span.stop - span.start for span in cells)
        return Shader(self.normal[:, rows, columns], self.alpha[rows, columns], count, self.bilinear)

    def main(self, lights: Lights) -> torch.Tensor:
        """Shading by the global light [3, H, W]."""
        return torch.einsum("ck,khw->chw", lights.glob, self.basis)

    def local(self, lights: Lights) -> torch.Tensor:
        """s^V, shading by the grid alone, modulated by M, on `box` [3, h', w'] (paper, equations 2 to 4)."""
        return self.unmodulated(lights) * self.box_alpha

    def unmodulated(self, lights: Lights) -> torch.Tensor:
        """Shading by the grid alone as if M were everywhere, on `box` [3, h', w']."""
        scalar = (self._read(lights) * self.box_basis).sum(1)  # [G, h', w']
        return scalar * lights.chroma[:, None, None] if len(scalar) == 1 else scalar

    def coefficients(self, lights: Lights) -> torch.Tensor:
        """gamma^V M of every texel of `box` [G, 9, h', w']: what gamma is beyond gamma^g."""
        return self._read(lights) * self.box_alpha

    def _read(self, lights: Lights) -> torch.Tensor:
        """gamma^V of every texel of `box` [G, 9, h', w']."""
        return self.up_rows @ lights.grid @ self.up_columns.T

    def total(self, lights: Lights) -> torch.Tensor:
        """Shading [3, H, W]."""
        shading = self.main(lights)
        if not self.empty:
            shading[(slice(None), *self.box)] += self.local(lights)
        return shading


def interpolation_matrix(cells: int, texels: int, bilinear: bool = False) -> torch.Tensor:
    """The matrix [texels, cells] that resamples a line by the cubic kernel (a = -0.5) or the linear one, half-pixel
    centres, borders repeated.

    To shrink, the kernel widens with the step (antialiasing).
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


def fit_global(
    texture: torch.Tensor, albedo: torch.Tensor, basis: torch.Tensor, weight: torch.Tensor, ridge: float = 1e-3
) -> torch.Tensor:
    """gamma^g that minimises sum weight^2 (texture - albedo * shading)^2 in closed form.

    Parameters
    ----------
    texture, albedo : [3, H, W], linear
    basis : [9, H, W], `shading_basis` of the normals
    weight : [H, W] in [0, 1]
    ridge : times the mean diagonal, keeps coefficients that no normal sees at zero

    Returns
    -------
    [3, 9], float32.
    """
    exact = torch.float32 if basis.device.type == "mps" else torch.float64  # Apple's GPUs have no float64
    columns = basis.reshape(9, -1).to(exact)
    w2 = weight.reshape(-1).to(exact) ** 2
    out = []
    for t, a in zip(texture.reshape(3, -1).to(exact), albedo.reshape(3, -1).to(exact), strict=True):
        normal_matrix = (columns * (w2 * a * a)) @ columns.T
        identity = torch.eye(9, dtype=exact, device=basis.device)
        damping = ridge * normal_matrix.diagonal().mean().clamp_min(1e-12) * identity
        # `solve` asks the device whether it went well
        out.append(torch.linalg.solve_ex(normal_matrix + damping, (columns * (w2 * a)) @ t)[0])
    return torch.stack(out).float()


def fit_around_constant(
    texture: torch.Tensor, albedo: torch.Tensor, basis: torch.Tensor, weight: torch.Tensor, ridge: float
) -> torch.Tensor:
    """`fit_global`, but what no normal sees, and what `ridge` holds back, is drawn to the even light that gives the
    texture's mean colour.

    Parameters
    ----------
    texture, albedo, basis, weight, ridge : as in `fit_global`

    Returns
    -------
    [3, 9], float32.
    """
    total = weight.sum().clamp_min(1e-6)
    even = constant_light((texture * weight).sum((1, 2)) / (albedo * weight).sum((1, 2)).clamp_min(1e-4 * total))
    return even + fit_global(texture - albedo * torch.einsum("ck,khw->chw", even, basis), albedo, basis, weight, ridge)


def constant_light(shade: torch.Tensor) -> torch.Tensor:
    """gamma^g [3, 9] whose shading is `shade` [3] for every normal."""
    glob = shade.new_zeros(3, 9)
    glob[:, 0] = shade / GAMMA_BANDS[0]
    return glob


def _linear(t: np.ndarray) -> np.ndarray:
    return np.maximum(1 - np.abs(t), 0)


def _cubic(t: np.ndarray) -> np.ndarray:
    t = np.abs(t)
    return np.where(t <= 1, 1.5 * t**3 - 2.5 * t**2 + 1, np.where(t < 2, -0.5 * t**3 + 2.5 * t**2 - 4 * t + 2, 0.0))
