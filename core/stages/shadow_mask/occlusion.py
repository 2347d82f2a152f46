# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Ambient occlusion that stayed baked into the texture, beside the nose, in the eye sockets, under lip and chin: the
paper's automatic mask misses it.

The head's shape says where the sky is hidden and by how much; the texture says how much of that darkening it still
shows. Only where both agree is there something to mask.
"""

from __future__ import annotations

import cv2
import numpy as np

# occlusion, in log units of the sky's light, below which skin stands free; around it the skin's own lightness is taken
OPEN_LOG = 0.15
AROUND_SIDE_SHARE = 0.05  # deviation of the neighbourhood, as a share of the map
WINDOW_SIDE_SHARE = 0.012  # deviation of the window in which shape and texture are compared
LEAST_CORRELATION = 0.35  # least correlation of the two there
LEAST_DARKENING_LOG, SURE_DARKENING_LOG = 0.06, 0.30  # darkening in log units from which it counts, and counts in full
FULL_ALPHA = 0.5  # alpha where it counts in full: occlusion takes a part of the light only


def baked_occlusion(luminance: np.ndarray, visible: np.ndarray, skin: np.ndarray) -> np.ndarray:
    """How far the solver shall look for occlusion, [S, S] in [0, FULL_ALPHA].

    luminance [S, S]: log of the texture's; visible [S, S] in [0, 1]: the sky's share that the head's shape lets
    through; skin [S, S] in [0, 1]: plain skin that is in no cast shadow.
    """
    size = len(luminance)
    hidden = -np.log(np.clip(visible, 0.05, 1)).astype(np.float32)
    weight = skin.astype(np.float32)
    free = weight * np.clip(1.5 - hidden / OPEN_LOG, 0, 1)
    known = np.clip(cv2.GaussianBlur(free, (0, 0), AROUND_SIDE_SHARE * size), 1e-5, None)

    def over_free(image: np.ndarray) -> np.ndarray:
        return cv2.GaussianBlur(image.astype(np.float32) * free, (0, 0), AROUND_SIDE_SHARE * size) / known

    darker, deeper = over_free(luminance) - luminance, hidden - over_free(hidden)  # against the free skin around
    sigma = WINDOW_SIDE_SHARE * size
    total = np.maximum(cv2.GaussianBlur(weight, (0, 0), sigma), 1e-3)
    together, squares, others = (
        cv2.GaussianBlur((weight * a * b).astype(np.float32), (0, 0), sigma) / total
        for a, b in ((deeper, darker), (deeper, deeper), (darker, darker))
    )
    agreement = together / np.sqrt(np.maximum(squares * others, 1e-8))
    # of the occlusion, what the texture shows
    shown = np.clip(together / np.maximum(squares, 1e-3), 0, 1) * np.maximum(deeper, 0)
    sure = np.clip((agreement - LEAST_CORRELATION) / (0.8 - LEAST_CORRELATION), 0, 1) * np.clip(
        (known - 0.02) / 0.05, 0, 1
    )
    return (
        FULL_ALPHA
        * sure
        * np.clip((shown - LEAST_DARKENING_LOG) / (SURE_DARKENING_LOG - LEAST_DARKENING_LOG), 0, 1)
        * weight
    ).astype(np.float32)
