# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Infer the albedo of an iris from its ratios to the white around it and to the skin beside it.

Ratios know neither the exposure, nor the white balance, nor the tone that was chosen for the skin. Iris, white and skin
of a person are one Gaussian in the logarithm, fitted to measured people (`research.training irises`): whites are much
alike, so they tell the light at the eye; skin tells less, for its tone is not known here. White and iris are as a
camera sees them, under the lids' shade.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

DATA_FILES = ("weights/irises.json",)
MODEL_FILE = Path(__file__).parents[2] / DATA_FILES[0]
BRIGHTEST_SHARE = 0.4  # of the white's pixels, which neither the upper lid nor lashes shade


@dataclass(frozen=True)
class MeasuredEyes:
    """Natural log of the linear albedo of iris, white and skin: mean [9] and covariance [9, 9] over people.

    over_white, over_skin: deviation of one reading of these ratios.
    """

    mean: np.ndarray
    covariance: np.ndarray
    over_white: float
    over_skin: float


def expect_iris(over_skin: np.ndarray, over_white: np.ndarray | None = None) -> np.ndarray:
    """Return the expected linear albedo [3] of an iris by its ratios [3] to skin and, if that is seen, to white."""
    eyes, one = read_measured_eyes(), np.eye(3)
    ratios, deviations, rows = [over_skin], [eyes.over_skin], [np.hstack([one, 0 * one, -one])]
    if over_white is not None:
        ratios, deviations = [*ratios, over_white], [*deviations, eyes.over_white]
        rows.append(np.hstack([one, -one, 0 * one]))
    seen, matrix = np.log(np.concatenate(ratios)), np.vstack(rows)
    noise = np.diag(np.repeat(np.square(deviations), 3))
    shared = eyes.covariance @ matrix.T
    gain = np.linalg.solve(matrix @ shared + noise, shared[:3].T).T
    return np.exp(eyes.mean[:3] + gain @ (seen - matrix @ eyes.mean))


def average_white(colours: np.ndarray) -> np.ndarray:
    """Return the colour [3] of a white by its pixels, linear [N, 3]."""
    brightness = colours.sum(1)
    return np.median(colours[brightness >= np.quantile(brightness, 1 - BRIGHTEST_SHARE)], axis=0)


@cache
def read_measured_eyes() -> MeasuredEyes:
    stored = json.loads(MODEL_FILE.read_text(encoding="utf-8"))
    return MeasuredEyes(
        np.array(stored["mean"]), np.array(stored["covariance"]), stored["over_white"], stored["over_skin"]
    )
