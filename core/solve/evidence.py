# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the solver knows of a capture: texture, confidence, normals and masks at the size it solves, and the same again
for its coarser maps."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import torch

from ..contract.capture import Capture
from ..contract.messages import Problem
from ..contract.stages import advise_again
from ..face import beard, template
from ..face.head import Head
from ..face.shown_parts import read_hidden_skin
from ..geometry import raster
from ..imaging import images
from .lighting import Shader
from .prior import make_coordinates
from .problem import Observation, blur_maps
from .recipes import Recipe

REFERENCE_TEXELS = 1024  # lengths in texels are given for maps of this size
FULL_CONFIDENCE = 0.2  # confidence from which a texel counts in full: below, it was seen at a glancing angle only
# of brows, lips, lids and hair: they vary between people more than skin does, and light must not explain them away
FEATURE_TRUST = 0.2
BEARD_TRUST = 0.1  # of skin under a beard: the shade of a shaven one is as soft as a light's
MASK_FADE_TEXELS = 2.0  # deviation in texels over which a hard mask's border fades
# texels of REFERENCE_TEXELS over which settings.solve.grid_cells are counted, as in the paper: 96 cells are of 8 texels
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
        """The side of a cell of V, in texels where the whole map has REFERENCE_TEXELS, when settings.solve.grid_cells
        of them are asked for."""
        return FACE_CROP_TEXELS / grid_cells * REFERENCE_TEXELS / self.extent.side


def read_evidence(capture: Capture, head: Head, size: int) -> Evidence:
    """The capture's texture, confidence, head and masks at size x size. Raises Problem for what is missing, empty or of
    another shape."""
    texture = images.read_linear(capture.texture)
    confidence = images.read_data(capture.texture_confidence)[..., 0]
    if texture.shape[:2] != confidence.shape or texture.shape[0] != texture.shape[1]:
        raise Problem(
            f"{capture.texture} is {texture.shape[1]} x {texture.shape[0]} pixels and "
            f"{capture.texture_confidence.name} {confidence.shape[1]} x "
            f"{confidence.shape[0]}: both have to be square and of one size.",
            advise_again("texture"),
        )
    confidence, texture = np.clip(confidence, 0, 1), np.clip(texture, 0, None)
    if confidence.max() < 1e-3:
        raise Problem(
            "No texel of the texture was seen by any frame.",
            "Run the stage Cameras again and those after it, and look at the report.",
        )
    hidden = read_hidden_skin(capture, size)
    seen, bearded = _sized(confidence, size), np.maximum(_sized(beard.seen_in(texture, confidence), size), hidden)
    # what nobody saw must not darken its neighbours
    texture = _sized(texture * confidence[..., None], size) / np.maximum(seen, 1e-4)[..., None]
    covered = head.raster(size)[0] >= 0
    normal = raster.bleed(head.interpolate(head.normals, size), covered)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-6)
    mask, added = _shadow_mask(capture, size)
    protected = (
        _sized(images.read_mask(capture.protect_mask), size) if capture.protect_mask.is_file() else np.zeros_like(mask)
    )
    alpha = soften_mask(mask) * (1 - protected)
    skin = template.mask("skin", size) * template.mask("face", size)
    skin = skin * (1 - template.mask("eyes", size)) * (1 - bearded)
    weight = np.where(covered, np.clip(seen / FULL_CONFIDENCE, 0, 1), 0)
    tensors = [
        np.ascontiguousarray(a, np.float32)
        for a in (texture.transpose(2, 0, 1), weight, np.where(covered, alpha, 0), normal.transpose(2, 0, 1))
    ]
    unlike_skin = np.maximum.reduce(
        [template.mask(name, size) for name in ("brows", "lips", "eyes", "nostrils", "scalp")]
    )
    bare = (1 - unlike_skin) * (1 - bearded)
    trust = np.minimum(1 - (1 - FEATURE_TRUST) * unlike_skin, 1 - (1 - BEARD_TRUST) * bearded)
    parts = [
        torch.from_numpy(np.ascontiguousarray(a, np.float32))
        for a in (
            skin,
            bare,
            trust,
            protected,
            np.zeros_like(alpha),
            _brightness(capture, texture, skin * weight > 0.5),
            added,
        )
    ]
    return Evidence(*map(torch.from_numpy, tensors), torch.from_numpy(covered), *parts)


def _brightness(capture: Capture, texture: np.ndarray, skin: np.ndarray) -> np.ndarray:
    """[S, S]: how bright the frames show a texel, over its median where `skin`; of the delit texture where no other is
    there."""
    filmed = (
        _sized(images.read_linear(capture.texture_filmed), len(skin)) if capture.texture_filmed.is_file() else texture
    )
    brightness = filmed.mean(2)
    return brightness / max(np.median(brightness[skin]) if skin.any() else brightness.mean(), 1e-6)


def _shadow_mask(capture: Capture, size: int) -> tuple[np.ndarray, np.ndarray]:
    """M [S, S] in [0, 1], the artist's before the proposal; and where the artist added to the proposal. That says more
    than a proposal, which takes dark skin and beards along: there the light need not be held back."""
    painted, proposed = capture.shadow_mask.is_file(), capture.shadow_mask_auto.is_file()
    mask = _sized(images.read_mask(capture.shadow_mask if painted else capture.shadow_mask_auto), size)
    proposal = _sized(images.read_mask(capture.shadow_mask_auto), size) if painted and proposed else mask
    return mask, np.clip(mask - proposal, 0, 1)


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
        weight, alpha, trust, edge, protected = (torch.from_numpy(_sized(a.numpy(), size)) for a in maps)
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
        restraint = 1 - torch.from_numpy(_sized(evidence.added.numpy(), size))
        missing = 0.0 if evidence.missing is None else torch.from_numpy(_sized(evidence.missing.numpy(), size))
        levels[factor] = Observation(
            texture, weight, trust, coords, shader, torch.from_numpy(ring), extent.side / size, restraint, missing
        )
    return levels


def grid_cells(cell: float) -> tuple[int, int]:
    """Cells (rows, columns) of the light grid over the whole map."""
    count = max(1, round(REFERENCE_TEXELS / cell))
    return count, count


def _shrunk(maps: torch.Tensor, size: int) -> torch.Tensor:
    """[C, S, S] -> [C, size, size]."""
    return torch.from_numpy(np.ascontiguousarray(_sized(maps.permute(1, 2, 0).numpy(), size).transpose(2, 0, 1)))


def _sized(image: np.ndarray, size: int) -> np.ndarray:
    """[S, S(, C)] at another size: areas averaged to shrink, bilinear to enlarge."""
    if image.shape[:2] == (size, size):
        return image
    shrinks = size < image.shape[0]
    return cv2.resize(
        np.ascontiguousarray(image), (size, size), interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    )
