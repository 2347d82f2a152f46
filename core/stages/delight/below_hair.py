# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Light knows no hair: below it, and on the eyes, the shading is what the skin around them says, so that none of their
colour is taken for light.

In a single photograph that holds for brows and eyes: what a shadow does that crosses them is lost, and a beard covers
too much of a face, so what is light on it is left to the network. In a capture the light that was fitted to the bare
skin goes on below beard and hair and on the eyes, by the head's own shape, which no hair stands out from: it is too
bright where hair shades hair, as the network, which takes dark hair for shade, is too dark. So the mean of both counts.
Brows, which lie where shading changes most, are left to both answers as skin is.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

from .evening import ShadingEstimate

FEATURES = ("brows", "eyes")
MIN_HAIR_SHARE = 0.3  # share of a cell from which it is not asked what its shading is
REACH_CELLS = 1  # cells around them: the network's answer is as coarse as that
FITTED_SHARE = 0.5
"""How far the fitted light counts below hair. On a full beard whose strands' albedo is known (-0.90 in natural log
against the skin) it leaves -0.41 too much and the network +0.48; a second beard errs alike."""


def fill_features(shading: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Log-shading [h, h, C] with that of cells whose `share` [h, h] of FEATURES is MIN_HAIR_SHARE, and of those around
    them, carried over from the skin."""
    return complete_shading(shading, _covered(share)).astype(np.float32)


def fill_hair(look: ShadingEstimate, own: ShadingEstimate, fitted: np.ndarray, share: np.ndarray) -> ShadingEstimate:
    """The look with the mean of both answers below hair, and the shadow that is seen around.

    Parameters
    ----------
    look : what is mended
    own : the network's answer
    fitted : [h, h, 3], the fitted log-shading, taken at the level at which it meets the skin around
    share : [h, h] in [0, 1], of hair
    """
    here = look.face >= 0
    hairy, bare = _covered(share) & here, here & ~_covered(share)
    if not hairy.any() or not bare.any():
        return look
    known = np.concatenate([look.shading - fitted, look.shadow[..., None]], -1)
    around = complete_shading(np.where(bare[..., None], known, 0), ~bare)
    moved = own.shading + FITTED_SHARE * (fitted + around[..., :3] - own.shading)
    return replace(
        look,
        shading=np.where(hairy[..., None], moved, look.shading).astype(np.float32),
        shadow=np.where(hairy, around[..., 3], look.shadow).astype(np.float32),
    )


def _covered(share: np.ndarray) -> np.ndarray:
    """bool [h, h]: the cells whose share of hair is MIN_HAIR_SHARE, and those around them."""
    return cv2.dilate((share > MIN_HAIR_SHARE).astype(np.uint8), np.ones((2 * REACH_CELLS + 1,) * 2, np.uint8)) > 0


def complete_shading(field: np.ndarray, unknown: np.ndarray) -> np.ndarray:
    """Values [H, W, C] with those where `unknown` bool [H, W] replaced by the smoothest surface that meets the others
    (a harmonic one)."""
    if not unknown.any() or unknown.all():
        return field
    height, width = unknown.shape
    number = np.full(unknown.shape, -1)
    number[unknown] = np.arange(unknown.sum())
    y, x = np.nonzero(unknown)
    rows, columns, degree = [], [], np.zeros(len(y))
    fixed = np.zeros((len(y), field.shape[-1]))
    for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        ny, nx = y + dy, x + dx
        inside = (ny >= 0) & (ny < height) & (nx >= 0) & (nx < width)
        degree += inside
        near = number[np.clip(ny, 0, height - 1), np.clip(nx, 0, width - 1)]
        free = inside & (near >= 0)
        rows.append(np.flatnonzero(free))
        columns.append(near[free])
        known = inside & (near < 0)
        fixed[known] += field[ny[known], nx[known]]
    rows, columns = np.concatenate(rows), np.concatenate(columns)
    laplacian = sparse.diags(degree) - sparse.coo_matrix((np.ones(len(rows)), (rows, columns)), (len(y), len(y)))
    out = field.copy()
    out[unknown] = np.stack([spsolve(laplacian.tocsc(), fixed[:, k]) for k in range(fixed.shape[1])], -1)
    return out
