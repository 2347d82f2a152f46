# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading below hair and on the eyes, filled from the surrounding skin, so that their colour is not taken for light.

In a single photograph that is done for brows and eyes: what a shadow does that crosses them is lost, and a beard covers
too much of a face, so light on it is left to the network. In a capture the light that was fitted to the bare skin goes
on below beard and hair and on the eyes, by the head's own shape, which no hair stands out from: it is too bright where
hair shades hair, as the network, which takes dark hair for shade, is too dark. So the mean of both counts. Brows, which
lie where shading changes most, are left to both answers as skin is.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

from .evening import ShadingEstimate

FEATURES = ("brows", "eyes")
MIN_HAIR_SHARE = 0.3  # share of hair from which a cell's shading is filled
REACH_CELLS = 1  # cells around them: the network's answer is as coarse as that
FITTED_SHARE = 0.5
"""Weight of the fitted light below hair. On a full beard whose strands' albedo is known (-0.90 in natural log against
the skin) it leaves -0.41 too much and the network +0.48; a second beard errs alike."""


def fill_features(shading: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Fill log-shading [h, h, C] at and around cells whose `share` [h, h] of FEATURES exceeds MIN_HAIR_SHARE."""
    return complete_shading(shading, _covered(share)).astype(np.float32)


def fill_hair(look: ShadingEstimate, own: ShadingEstimate, fitted: np.ndarray, share: np.ndarray) -> ShadingEstimate:
    """Fill a look below hair with the mean of the network's `own` answer and the fitted log-shading [h, h, 3].

    The latter is taken at the level at which it meets the skin around; the shadow is that of the skin around. share [h,
    h] in [0, 1]: of hair.
    """
    here = look.face >= 0
    hairy, bare = _covered(share) & here, here & ~_covered(share)
    if not hairy.any() or not bare.any():
        return look
    offset = np.concatenate([look.shading - fitted, look.shadow[..., None]], -1)
    around = complete_shading(np.where(bare[..., None], offset, 0), ~bare)
    filled = own.shading + FITTED_SHARE * (fitted + around[..., :3] - own.shading)
    return replace(
        look,
        shading=np.where(hairy[..., None], filled, look.shading).astype(np.float32),
        shadow=np.where(hairy, around[..., 3], look.shadow).astype(np.float32),
    )


def _covered(share: np.ndarray) -> np.ndarray:
    """Return bool [h, h]: cells whose share of hair exceeds MIN_HAIR_SHARE, and those around them."""
    return cv2.dilate((share > MIN_HAIR_SHARE).astype(np.uint8), np.ones((2 * REACH_CELLS + 1,) * 2, np.uint8)) > 0


def complete_shading(field: np.ndarray, unknown: np.ndarray) -> np.ndarray:
    """Replace values [H, W, C] where `unknown` bool [H, W] by the harmonic surface that meets the others."""
    if not unknown.any() or unknown.all():
        return field
    height, width = unknown.shape
    laplacian = sparse.kronsum(_path_laplacian(width), _path_laplacian(height), format="csr")
    hole = unknown.ravel()
    rows = laplacian[hole]
    out = field.copy()
    out[unknown] = spsolve(rows[:, hole].tocsc(), -(rows[:, ~hole] @ field[~unknown]))
    return out


def _path_laplacian(length: int) -> sparse.dia_array:
    """Return the graph Laplacian [N, N] of N cells in a row."""
    degree = np.full(length, 2.0)
    degree[[0, -1]] = 1
    return sparse.diags_array([-np.ones(length - 1), degree, -np.ones(length - 1)], offsets=[-1, 0, 1])
