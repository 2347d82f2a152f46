# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The skin tone that a camera's picture of skin stands for, over the tones of all people evenly, and how sure that is.

A picture's colour of skin is the tone times exposure and light. Its brightness tells of the tone only as far as a
camera's meter lets it, its colour only as far as the white point is known: both are a Gaussian around what simulated
phones make of simulated people (`core train tones`), or around what a measured white surface says. The posterior over
the tones gives the estimate. It is then stretched by what a Gaussian prior had drawn it to the middle: without that,
dark skin would come out too light and light skin too dark, the more so the less is known.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from skimage import color

from ..imaging import images
from .look import LUMINANCE_WEIGHTS, Look
from .skin_tone import DECIMALS, SCENE, WHITE_POINT, SkinTone

DATA_FILES = ("weights/tones.json",)
MODEL_FILE = Path(__file__).parents[1] / DATA_FILES[0]
# of a white surface's brightness: what skin of any tone reflects without taking colour, and no view is free of
SHEEN_REFLECTANCE = 0.015
SHEEN_SIGMA_LOG = 0.5  # deviation of the sheen in log units: oily and dry skin
MAX_STRETCH = 2.0  # at most
# deviations in log units of a measured white: of its level (the face may be lit otherwise), and of its colour
MEASURED_SIGMA_LOG = 0.10, 0.025
# deviation of L* that is always stated: faces differ from their tone's mean in more ways than the model has
MIN_SIGMA_L = 1.5
TONE_SPACING_LOG = 0.02  # log units between the population's tones: they stand for what lies between them, too
TYPOLOGY_GROUPS = ((55, "very light"), (41, "light"), (28, "intermediate"), (10, "tan"), (-30, "brown"), (-91, "dark"))
"""Individual typology angle in degrees above which a tone is of a group (Chardon et al. 1991; Del Bino and Bernerd
2013)."""


@dataclass(frozen=True)
class Population:
    """tones [N, 3] linear, of all groups alike; what a phone shows of one is slope [9, 3] times the `to_coordinates` of
    the tone with its sheen plus offset [9], with this covariance [9, 9]: the coordinates of the best lit skin, of the
    surroundings, and of skin facing the front over a white surface there."""

    tones: np.ndarray
    slope: np.ndarray
    offset: np.ndarray
    covariance: np.ndarray


BEST_ROWS, SURROUNDINGS_ROWS, OVER_WHITE_ROWS = [0, 1, 2], [3, 4, 5], [6, 7, 8]  # rows of the model


def estimate_skin_tone(look: Look, white: np.ndarray | None = None) -> SkinTone:
    """The tone behind a look, with its deviation, error and group; `white` [3] is the measured linear colour of a white
    surface that faces as the face does, or None. Its sRGB is rounded to DECIMALS, as a tone that is typed has no
    more."""
    if white is not None:
        return _posterior(OVER_WHITE_ROWS, to_coordinates(look.front) - to_coordinates(white),
                          np.square([MEASURED_SIGMA_LOG[0], MEASURED_SIGMA_LOG[1], MEASURED_SIGMA_LOG[1]]), WHITE_POINT)
    if look.surroundings is None:
        return _posterior(BEST_ROWS, to_coordinates(look.best), np.zeros(3), SCENE)
    shown = np.concatenate([to_coordinates(look.best), to_coordinates(look.surroundings)])
    return _posterior(BEST_ROWS + SURROUNDINGS_ROWS, shown, np.zeros(6), SCENE)


def _posterior(rows: list[int], coordinates: np.ndarray, variance: np.ndarray, source: str) -> SkinTone:
    """The estimate from these rows of the model, whose `coordinates` [R] are seen; `variance` is added to the model's
    own."""
    known = read_population()
    of_tones = to_coordinates(known.tones + SHEEN_REFLECTANCE)
    away = coordinates - of_tones @ known.slope[rows].T - known.offset[rows]
    # [N, R]: on dark skin sheen is much of what is seen
    shiny = (to_coordinates(known.tones + SHEEN_REFLECTANCE * np.exp(SHEEN_SIGMA_LOG)) - of_tones) @ known.slope[rows].T
    covariance = (
        known.covariance[np.ix_(rows, rows)]
        + np.diag(variance)
        + TONE_SPACING_LOG**2 * np.eye(len(rows))
        + shiny[:, :, None] * shiny[:, None, :]
    )
    likelihood = -0.5 * (np.einsum("ni,nij,nj->n", away, np.linalg.inv(covariance), away)
                         + np.linalg.slogdet(covariance)[1])
    weight = np.exp(likelihood - likelihood.max())
    return _stretched(known.tones, weight / weight.sum(), source)


def to_coordinates(linear: np.ndarray) -> np.ndarray:
    """Linear colours [..., 3] -> ln luminance, ln R/G, ln B/G [..., 3]."""
    log = np.log(np.maximum(linear, 1e-4))
    return np.stack([np.log(np.maximum(linear @ LUMINANCE_WEIGHTS, 1e-4)), log[..., 0] - log[..., 1],
                     log[..., 2] - log[..., 1]], -1)


def to_lab(linear: np.ndarray) -> np.ndarray:
    """Linear sRGB [..., 3] -> CIE L*a*b* under D65."""
    return color.rgb2lab(images.linear_to_srgb(linear))


def from_lab(lab: np.ndarray) -> np.ndarray:
    """The inverse of `to_lab`; values outside of sRGB are brought to its border."""
    return np.clip(images.srgb_to_linear(color.lab2rgb(lab)), 1e-3, 1)


def name_group(linear: np.ndarray) -> str:
    """The name of a tone's group, by its typology angle."""
    lightness, _, yellow = to_lab(linear)
    angle = np.degrees(np.arctan2(lightness - 50, yellow))
    return next(name for least, name in TYPOLOGY_GROUPS if angle > least)


@cache
def read_population() -> Population:
    stored = json.loads(MODEL_FILE.read_text(encoding="utf-8"))
    return Population(*(np.array(stored[name]) for name in Population.__dataclass_fields__))


def _stretched(tones: np.ndarray, weight: np.ndarray, source: str) -> SkinTone:
    """The posterior over the tones [N, 3] as an estimate without the prior's pull: for Gaussians of prior variance P
    and posterior variance V the likelihood's own centre is P / (P - V) times as far from the prior's mean, with
    variance P V / (P - V). Along L*; a* and b* follow as they go with it under the posterior."""
    lab = to_lab(tones)
    prior, mean = lab.mean(0), weight @ lab
    covariance = (lab - mean).T @ ((lab - mean) * weight[:, None])
    variance, before = max(covariance[0, 0], 1e-6), lab[:, 0].var()
    factor = min(before / max(before - variance, 1e-6), MAX_STRETCH)
    lightness = np.clip(prior[0] + factor * (mean[0] - prior[0]), lab[:, 0].min(), lab[:, 0].max())
    moved = mean + covariance[:, 0] / variance * (lightness - mean[0])
    linear = from_lab(moved)
    error = weight @ color.deltaE_ciede2000(lab, np.broadcast_to(to_lab(linear), lab.shape))
    deviation = float(np.hypot(np.sqrt(factor * variance), MIN_SIGMA_L))
    rounded = [round(float(value), DECIMALS) for value in images.linear_to_srgb(linear)]
    return SkinTone.from_srgb(rounded, source, deviation=deviation, error=float(error), group=name_group(linear))
