# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reference answers that stand in every table beside a method's.

doing nothing     the picture or texture as filmed: keeps all of the face, and all of the light
flat colour       one colour everywhere: no light, and no face
blur divided out  what one does by hand: keeps what is small, light and skin alike
true light        the true light divided out: what the registration and the texture leave
"""

import cv2
import numpy as np

NOTHING, FLAT, BLUR, TRUE = "doing nothing", "flat colour", "blur divided out", "true light"
BLURRED = 0.02
"""Deviation of the blur as a share of the face's height."""
DARKEST = 1e-3


def flat_colour(filmed: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return the filmed picture's mean over the pixels, bool [H, W], everywhere; linear [H, W, 3]."""
    return np.broadcast_to(filmed[mask].mean(0), filmed.shape).astype(np.float32)


def blur_divided_out(filmed: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return linear [H, W, 3] over its own blur within the mask, bool [H, W], each channel apart."""
    deviation = BLURRED * face_height(mask)
    weight = mask.astype(np.float32)
    share = np.maximum(cv2.GaussianBlur(weight, (0, 0), deviation), 1e-4)[..., None]
    blurred = cv2.GaussianBlur((filmed * weight[..., None]).astype(np.float32), (0, 0), deviation) / share
    return np.where(mask[..., None], filmed / np.maximum(blurred, DARKEST) * filmed[mask].mean(0), filmed).astype(
        np.float32
    )


def face_height(mask: np.ndarray) -> float:
    """Return the number of rows that a mask [H, W] spans."""
    rows = np.flatnonzero(mask.any(1))
    return float(rows[-1] - rows[0] + 1) if len(rows) else 1.0
