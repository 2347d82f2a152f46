# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Input of the solver: texture I_UV, confidence, normals N_c and masks, at the size of the solve and coarser."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import torch

from .lighting import Shader
from .objective import Observation, blur_maps
from .prior.prior import make_coordinates
from .recipes import Recipe

REFERENCE_TEXELS = 1024  # lengths in texels are given for maps of this size
MASK_FADE_TEXELS = 2.0  # deviation in texels over which a hard mask's border fades
# texels of REFERENCE_TEXELS over which the cells of V are counted, as in the paper: 96 of them are of 8 texels
FACE_CROP_TEXELS = 768


@dataclass(frozen=True)
class Extent:
    """Part of the UV square that the maps cover, in texels of REFERENCE_TEXELS.

    It has `side` rows from `top` on and as many columns from `left` on. The prior takes the coordinates of texel
    centres, or (not `centred`) of their upper left corners, and knows maps that are coarser by `factors`.
    """

    top: int = 0
    left: int = 0
    side: int = REFERENCE_TEXELS
    centred: bool = True
    factors: tuple[int, ...] = (1, 2, 4)


@dataclass(frozen=True)
class Evidence:
    """Maps [S, S] in [0, 1] of one capture, if not said otherwise.

    texture [3, S, S] linear; weight: how much it counts, 0 if unseen; alpha: the soft shadow mask M; normal [3, S, S],
    unit, world space, N_c; covered bool: texels of the head; skin: facial skin without lips, brows, eyes and hair;
    bare: skin of neck and ears as well; trust: less than 1 if a texel's colour says little of the light; protected:
    what the artist keeps out of M; edge: how far M's border lies on a visible shadow edge; filmed: brightness in the
    frames over usual skin's; added: what the artist added to the proposal for M; shadow_colour [3]: of what shadows
    take of the light, over its mean, zeros if unknown; missing: the share of the light that M's border says is missing;
    hair: how probable beard and head hair are, None if unknown.
    """

    texture: torch.Tensor
    weight: torch.Tensor
    alpha: torch.Tensor
    normal: torch.Tensor
    covered: torch.Tensor
    skin: torch.Tensor
    bare: torch.Tensor
    trust: torch.Tensor
    protected: torch.Tensor
    edge: torch.Tensor
    filmed: torch.Tensor
    added: torch.Tensor
    shadow_colour: tuple[float, float, float] = (0.0, 0.0, 0.0)
    extent: Extent = Extent()
    missing: torch.Tensor | None = None
    hair: torch.Tensor | None = None

    @property
    def size(self) -> int:
        return self.alpha.shape[0]

    @property
    def texel(self) -> float:
        """Side of a texel in texels of REFERENCE_TEXELS."""
        return self.extent.side / self.size

    def cell_side(self, grid_cells: int) -> float:
        """Return a cell's side for so many cells across the face, in texels of a whole map of REFERENCE_TEXELS."""
        return FACE_CROP_TEXELS / grid_cells * REFERENCE_TEXELS / self.extent.side


def soften_mask(mask: np.ndarray) -> np.ndarray:
    """Fade the hard borders of a mask [S, S] over a few texels, as light does; faint remains become zero."""
    faded = cv2.GaussianBlur(mask, (0, 0), max(MASK_FADE_TEXELS * len(mask) / REFERENCE_TEXELS, 0.3))
    return np.clip((faded - 0.02) / 0.96, 0, 1)


def make_observations(evidence: Evidence, cell: float, multiple: int, recipe: Recipe) -> dict[int, Observation]:
    """Return the sampler's observations by coarsening factor.

    Maps coarser than a quarter of REFERENCE_TEXELS are left out: the prior has not seen them. `cell` is a grid cell's
    side in texels of REFERENCE_TEXELS, the network takes sides of a `multiple` of texels.
    """
    cells, extent = grid_cells(cell), evidence.extent
    levels = {}
    for factor in extent.factors:
        size = evidence.size // factor
        if factor > 1 and (size < REFERENCE_TEXELS // 4 or size % multiple or evidence.size % factor):
            continue
        names = "weight", "alpha", "trust", "edge", "protected", "added"
        weight, alpha, trust, edge, protected, added = (_resized(getattr(evidence, name), size) for name in names)
        texture = _resized(evidence.texture * evidence.weight, size) / weight.clamp_min(1e-4)
        texture = blur_maps(texture) if recipe.blur else texture
        normal = torch.nn.functional.normalize(_resized(evidence.normal, size), dim=0)
        inside = (alpha > (0.5 if recipe.hard_mask else 0)).numpy().astype(np.uint8)
        support = cv2.dilate(inside, np.ones((5, 5)))  # M and two texels around it
        ring = (support > 0) & ((inside == 0) if recipe.hard_mask else (alpha.numpy() < 0.5))
        ring &= edge.numpy() < 0.5  # a border that lies on a shadow's edge shall not be seamless
        modulation = (
            torch.from_numpy(support.astype(np.float32))
            if recipe.hard_mask
            else alpha + recipe.open * (1 - alpha) * (1 - protected)
        )
        whole = size * REFERENCE_TEXELS // extent.side
        top, left = (start * whole // REFERENCE_TEXELS for start in (extent.top, extent.left))
        coords = make_coordinates(whole, slice(top, top + size), slice(left, left + size), extent.centred)
        shader = Shader(normal, modulation, cells, recipe.bilinear)
        missing = 0.0 if evidence.missing is None else _resized(evidence.missing, size)
        levels[factor] = Observation(
            texture, weight, trust, coords, shader, torch.from_numpy(ring), extent.side / size, 1 - added, missing
        )
    return levels


def grid_cells(cell: float) -> tuple[int, int]:
    """Return the rows and columns of the light grid over the whole map."""
    count = max(1, round(REFERENCE_TEXELS / cell))
    return count, count


def resize_maps(image: np.ndarray, size: int) -> np.ndarray:
    """Resize a map [S, S(, C)] to [size, size(, C)]: areas averaged to shrink, bilinear to enlarge."""
    if image.shape[:2] == (size, size):
        return image
    shrinks = size < image.shape[0]
    return cv2.resize(
        np.ascontiguousarray(image), (size, size), interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    )


def _resized(maps: torch.Tensor, size: int) -> torch.Tensor:
    """Resize a map [S, S] or [C, S, S]."""
    if maps.dim() == 2:
        return torch.from_numpy(resize_maps(maps.numpy(), size))
    return torch.from_numpy(np.ascontiguousarray(resize_maps(maps.permute(1, 2, 0).numpy(), size).transpose(2, 0, 1)))
