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
OPEN = 0.15
AROUND = 0.05  # deviation of the neighbourhood, as a share of the map
WINDOW = 0.012  # deviation of the window in which shape and texture are compared
AGREE = 0.35  # least correlation of the two there
LEAST, SURE = 0.06, 0.30  # darkening in log units from which it counts, and counts in full
GENTLE = 0.5  # alpha where it counts in full: occlusion takes a part of the light only


def baked_occlusion(luminance: np.ndarray, visible: np.ndarray, skin: np.ndarray) -> np.ndarray:
    """How far the solver shall look for occlusion, [S, S] in [0, GENTLE].

    luminance [S, S]: log of the texture's; visible [S, S] in [0, 1]: the sky's share that the head's shape lets
    through; skin [S, S] in [0, 1]: plain skin that is in no cast shadow.
    """
    size = len(luminance)
    hidden = -np.log(np.clip(visible, 0.05, 1)).astype(np.float32)
    weight = skin.astype(np.float32)
    free = weight * np.clip(1.5 - hidden / OPEN, 0, 1)
    known = np.clip(cv2.GaussianBlur(free, (0, 0), AROUND * size), 1e-5, None)

    def over_free(values: np.ndarray) -> np.ndarray:
        return cv2.GaussianBlur(values.astype(np.float32) * free, (0, 0), AROUND * size) / known

    darker, deeper = over_free(luminance) - luminance, hidden - over_free(hidden)  # against the free skin around
    sigma = WINDOW * size
    total = np.maximum(cv2.GaussianBlur(weight, (0, 0), sigma), 1e-3)
    together, squares, others = (cv2.GaussianBlur((weight * a * b).astype(np.float32), (0, 0), sigma) / total
                                 for a, b in ((deeper, darker), (deeper, deeper), (darker, darker)))
    agreement = together / np.sqrt(np.maximum(squares * others, 1e-8))
    # of the occlusion, what the texture shows
    shown = np.clip(together / np.maximum(squares, 1e-3), 0, 1) * np.maximum(deeper, 0)
    sure = np.clip((agreement - AGREE) / (0.8 - AGREE), 0, 1) * np.clip((known - 0.02) / 0.05, 0, 1)
    return (GENTLE * sure * np.clip((shown - LEAST) / (SURE - LEAST), 0, 1) * weight).astype(np.float32)
