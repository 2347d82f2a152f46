# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Ambient occlusion baked into the texture: beside the nose, in the eye sockets, under lip and chin.

The paper's automatic mask misses it. The head's shape says where the sky is hidden and by how much; the texture says
how much of that darkening it still shows. Only where both agree is there something to mask.
"""

from __future__ import annotations

import cv2
import numpy as np

from ...imaging.normalized_convolution import weighted_blur

OPEN_LOG = 0.15  # occlusion below which skin stands free, in log units of the sky's light
AROUND_SIDE_SHARE = 0.05  # deviation of the neighbourhood whose free skin is the reference, as a share of the map
WINDOW_SIDE_SHARE = 0.012  # deviation of the window in which shape and texture are compared
LEAST_CORRELATION = 0.35  # of the two in that window
LEAST_DARKENING_LOG, SURE_DARKENING_LOG = 0.06, 0.30  # darkening in log units from which it counts, and counts in full
FULL_ALPHA = 0.5  # alpha where it counts in full: occlusion takes a part of the light only


def baked_occlusion(luminance: np.ndarray, visible: np.ndarray, skin: np.ndarray) -> np.ndarray:
    """Return the alpha [S, S] in [0, FULL_ALPHA] of occlusion.

    luminance [S, S]: log of the texture's; visible [S, S] in [0, 1]: share of the sky that the head's shape lets
    through; skin [S, S] in [0, 1]: plain skin outside cast shadows.
    """
    size = len(luminance)
    hidden = -np.log(np.clip(visible, 0.05, 1)).astype(np.float32)
    weight = skin.astype(np.float32)
    free = weight * np.clip(1.5 - hidden / OPEN_LOG, 0, 1)
    around = AROUND_SIDE_SHARE * size
    darker = weighted_blur(luminance.astype(np.float32), free, around, 1e-5) - luminance
    deeper = hidden - weighted_blur(hidden, free, around, 1e-5)

    def mean(product: np.ndarray) -> np.ndarray:
        return weighted_blur(product, weight, WINDOW_SIDE_SHARE * size, 1e-3)

    together, squares, others = mean(deeper * darker), mean(deeper * deeper), mean(darker * darker)
    agreement = together / np.sqrt(np.maximum(squares * others, 1e-8))
    # share of the occlusion that the texture shows
    shown = np.clip(together / np.maximum(squares, 1e-3), 0, 1) * np.maximum(deeper, 0)
    reference = cv2.GaussianBlur(free, (0, 0), around)
    sure = _ramp(agreement, LEAST_CORRELATION, 0.8) * _ramp(reference, 0.02, 0.07)
    return (FULL_ALPHA * sure * _ramp(shown, LEAST_DARKENING_LOG, SURE_DARKENING_LOG) * weight).astype(np.float32)


def _ramp(x: np.ndarray, low: float, high: float) -> np.ndarray:
    return np.clip((x - low) / (high - low), 0, 1)
