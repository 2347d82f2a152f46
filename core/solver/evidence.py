# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the solver is told of a face: texture, confidence, normals and masks at the size it solves, and the same again
for its coarser maps."""

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
    """Which part of the UV square the maps cover, in texels of REFERENCE_TEXELS: `side` rows from `top` on and as many
    columns from `left` on. The prior is told the coordinates of texel centres, or of their upper left corners (not
    `centred`), and knows maps that are coarser by `factors`."""

    top: int = 0
    left: int = 0
    side: int = REFERENCE_TEXELS
    centred: bool = True
    factors: tuple[int, ...] = (1, 2, 4)


@dataclass(frozen=True)
class Evidence:
    """texture [3, S, S] linear; weight [S, S]: how far it counts, 0 where nobody looked; alpha [S, S]: the soft shadow
    mask M; normal [3, S, S], unit, world space, N_c; covered bool [S, S]: texels of the head; skin [S, S]: facial skin
    without lips, brows, eyes and hair; bare [S, S]: that of neck and ears as well; trust [S, S]: 1, less where a
    texel's colour says little of the light; protected [S, S]: what the artist keeps out of M; edge [S, S]: how far M's
    border lies on a shadow's edge that is seen; shadow_colour [3]: the colour of what shadows take of the light, over
    its mean, zeros where that is not known; added [S, S]: how far the artist added to the proposal for M; missing [S,
    S]: the share of the light that M's border says is missing, None where nobody asked it."""

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

    @property
    def size(self) -> int:
        return self.alpha.shape[0]

    @property
    def texel(self) -> float:
        """Side of a texel in texels of REFERENCE_TEXELS."""
        return self.extent.side / self.size

    def cell_side(self, grid_cells: int) -> float:
        """The side of a cell of V, in texels where the whole map has REFERENCE_TEXELS, when `grid_cells` of them are
        asked for across the face."""
        return FACE_CROP_TEXELS / grid_cells * REFERENCE_TEXELS / self.extent.side


def soften_mask(mask: np.ndarray) -> np.ndarray:
    """A mask [S, S] in [0, 1] whose hard borders fade over a few texels, as the light's do; faint remains become
    zero."""
    faded = cv2.GaussianBlur(mask, (0, 0), max(MASK_FADE_TEXELS * len(mask) / REFERENCE_TEXELS, 0.3))
    return np.clip((faded - 0.02) / 0.96, 0, 1)


def make_observations(
    evidence: Evidence, exposure: float, cell: float, multiple: int, recipe: Recipe
) -> dict[int, Observation]:
    """The evidence as the sampler takes it, per coarsening factor. Maps coarser than a quarter of REFERENCE_TEXELS are
    left out: the prior has not seen them.

    Parameters
    ----------
    evidence : of the capture
    exposure : factor that the texture is multiplied by
    cell : side of a grid cell where the map has REFERENCE_TEXELS texels
    multiple : of which the network takes sides, in texels
    recipe : of the solve
    """
    cells, extent = grid_cells(cell), evidence.extent
    levels = {}
    for factor in extent.factors:
        size = evidence.size // factor
        if factor > 1 and (size < REFERENCE_TEXELS // 4 or size % multiple or evidence.size % factor):
            continue
        maps = (evidence.weight, evidence.alpha, evidence.trust, evidence.edge, evidence.protected)
        weight, alpha, trust, edge, protected = (torch.from_numpy(resize_maps(a.numpy(), size)) for a in maps)
        texture = _shrunk(evidence.texture * evidence.weight, size) / weight.clamp_min(1e-4) * exposure
        texture = blur_maps(texture) if recipe.blur else texture
        normal = torch.nn.functional.normalize(_shrunk(evidence.normal, size), dim=0)
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
        restraint = 1 - torch.from_numpy(resize_maps(evidence.added.numpy(), size))
        missing = 0.0 if evidence.missing is None else torch.from_numpy(resize_maps(evidence.missing.numpy(), size))
        levels[factor] = Observation(
            texture, weight, trust, coords, shader, torch.from_numpy(ring), extent.side / size, restraint, missing
        )
    return levels


def grid_cells(cell: float) -> tuple[int, int]:
    """Cells (rows, columns) of the light grid over the whole map."""
    count = max(1, round(REFERENCE_TEXELS / cell))
    return count, count


def resize_maps(image: np.ndarray, size: int) -> np.ndarray:
    """A map [S, S(, C)] as [size, size(, C)]: areas averaged to shrink, bilinear to enlarge."""
    if image.shape[:2] == (size, size):
        return image
    shrinks = size < image.shape[0]
    return cv2.resize(
        np.ascontiguousarray(image), (size, size), interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    )


def _shrunk(maps: torch.Tensor, size: int) -> torch.Tensor:
    """[C, S, S] -> [C, size, size]."""
    return torch.from_numpy(np.ascontiguousarray(resize_maps(maps.permute(1, 2, 0).numpy(), size).transpose(2, 0, 1)))
