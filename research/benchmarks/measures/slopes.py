# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Two slopes that tell skin from light, on pairs of pictures that differ in one of them alone.

Change only the pigment: the answer's albedo should follow (slope 1). Change only the light: it should not (slope 0).
Doing nothing scores 1 by the light, and nearly that by the pigment (what the camera's curve and the gloss make of it is
not in proportion); a flat colour 0 and 0. No answer that treats pigment and light alike can score better than one
number for both.
"""

import numpy as np

DARKEST = 1e-3


def slope(
    answers: tuple[np.ndarray, np.ndarray], causes: tuple[np.ndarray, np.ndarray], mask: np.ndarray
) -> float | None:
    """Return the slope of the change between two answers on the change between their causes, by least squares.

    causes: the two true albedos, or the two pictures; linear [H, W, 3]; mask: bool [H, W]. Changes are of logarithms,
    each channel about its mean, for a gain is not judged. None if the causes differ by less than 1 % in deviation.
    """
    moved, cause = (_change(pair, mask) for pair in (answers, causes))
    return float((moved * cause).sum() / (cause * cause).sum()) if cause.std() > 0.01 else None


def _change(pair: tuple[np.ndarray, np.ndarray], mask: np.ndarray) -> np.ndarray:
    one, other = (np.log(np.maximum(np.asarray(linear)[mask], DARKEST)) for linear in pair)
    change = (other - one).astype(np.float64)
    return change - change.mean(0)
