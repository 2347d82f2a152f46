# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimate the skin tone behind a camera's picture of skin, and its uncertainty.

A picture's colour of skin is the tone times exposure and light. Its brightness reveals the tone only as far as a
camera's meter allows, its colour only as far as the white point is known: both are a Gaussian around what simulated
phones make of simulated people, or around a measured white surface. The prior is measured facial skin
(`research.training tones` fits both): the people that were measured, their origins weighed alike; or, if a white
surface reveals the light and the prior must not draw a person to the middle, the same skin with every lightness alike.
The estimate is the posterior's mean, so it never leaves the measured range. The surroundings do not count: they say
little of the exposure, and white and black grounds moved real people by up to 64 L* (the page skin_tone.md).
"""

from __future__ import annotations

import itertools
import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from skimage import color

from ...imaging import images
from .look import LUMINANCE_WEIGHTS
from .skin_tone import WHITE_POINT, SkinTone

DATA_FILES = ("weights/tones.json",)
MODEL_FILE = Path(__file__).parents[2] / DATA_FILES[0]
# of a white surface's brightness: what skin of any tone reflects without taking colour, and no view is free of
SHEEN_REFLECTANCE = 0.015
SHEEN_SIGMA_LOG = 0.5  # deviation of the sheen in log units: oily and dry skin
# deviations in log units of a measured white: of its level (the face may be lit otherwise), and of its colour
MEASURED_SIGMA_LOG = 0.10, 0.025, 0.025
# deviation of L* that is always stated: faces differ from their tone's mean in more ways than the model has
MIN_SIGMA_L = 1.5
# nodes and weights of a Gaussian's quadrature by three points (Gauss-Hermite)
QUADRATURE = (-np.sqrt(3), 1 / 6), (0.0, 2 / 3), (np.sqrt(3), 1 / 6)
# individual typology angle in degrees above which a tone is of a group (Chardon et al. 1991; Del Bino and Bernerd 2013)
TYPOLOGY_GROUPS = ((55, "very light"), (41, "light"), (28, "intermediate"), (10, "tan"), (-30, "brown"), (-91, "dark"))


@dataclass(frozen=True)
class Population:
    """Measured people, and how phones show them.

    tones [N, 3] linear; share [N] of people, and even [N], the same with every lightness alike. A phone shows a tone as
    slope [6, 3] times the `to_coordinates` of the tone with its sheen plus offset [6], with this covariance [6, 6]: the
    coordinates of the best lit skin, and of skin facing the front over a white surface there. colour_sigma_l: deviation
    of L* among people of one colour.
    """

    tones: np.ndarray
    share: np.ndarray
    even: np.ndarray
    slope: np.ndarray
    offset: np.ndarray
    covariance: np.ndarray
    colour_sigma_l: float


BEST_ROWS, OVER_WHITE_ROWS = slice(0, 3), slice(3, 6)  # rows of the model


def estimate_from_scene(best: np.ndarray, source: str) -> SkinTone:
    """Return the tone behind the best lit skin, linear [3], no surer than its colour is: no frame reveals exposure."""
    people = read_population()
    weight = _posterior(people, people.share, BEST_ROWS, to_coordinates(best))
    return _expect(people.tones, weight, source, people.colour_sigma_l)


def estimate_from_white(front: np.ndarray, white: np.ndarray) -> SkinTone:
    """Return the tone behind skin that faces the front, linear [3], by the colour [3] of a white surface there."""
    people = read_population()
    coordinates = to_coordinates(front) - to_coordinates(white)
    weight = _posterior(people, people.even, OVER_WHITE_ROWS, coordinates, np.square(MEASURED_SIGMA_LOG))
    return _expect(people.tones, weight, WHITE_POINT, MIN_SIGMA_L)


def _posterior(
    people: Population, prior: np.ndarray, rows: slice, coordinates: np.ndarray, variance: np.ndarray | float = 0.0
) -> np.ndarray:
    """Return the probability [N] of tones of prior [N] if rows of the model show `coordinates` [3] +- `variance`."""
    of_tones = to_coordinates(people.tones + SHEEN_REFLECTANCE)
    away = coordinates - of_tones @ people.slope[rows].T - people.offset[rows]  # [N, 3]
    # on dark skin sheen is much of what is seen
    shiny = to_coordinates(people.tones + SHEEN_REFLECTANCE * np.exp(SHEEN_SIGMA_LOG)) - of_tones
    shiny = shiny @ people.slope[rows].T
    covariance = people.covariance[rows, rows] + np.eye(3) * variance
    covariance = covariance + shiny[:, :, None] * shiny[:, None, :]  # [N, 3, 3]
    log = -0.5 * (np.einsum("ni,nij,nj->n", away, np.linalg.inv(covariance), away) + np.linalg.slogdet(covariance)[1])
    weight = prior * np.exp(log - log.max())
    return weight / weight.sum()


def to_coordinates(linear: np.ndarray) -> np.ndarray:
    """Return ln luminance, ln R/G, ln B/G [..., 3] of linear colours [..., 3]."""
    log = np.log(np.maximum(linear, 1e-4))
    luminance = np.log(np.maximum(linear @ LUMINANCE_WEIGHTS, 1e-4))
    return np.stack([luminance, log[..., 0] - log[..., 1], log[..., 2] - log[..., 1]], -1)


def to_lab(linear: np.ndarray) -> np.ndarray:
    """Return CIE L*a*b* under D65 of linear sRGB [..., 3]."""
    return color.rgb2lab(images.linear_to_srgb(linear))


def from_lab(lab: np.ndarray) -> np.ndarray:
    """Return the linear sRGB of L*a*b* [..., 3]; colours outside of sRGB are brought to its border."""
    return np.clip(images.srgb_to_linear(color.lab2rgb(lab)), 1e-3, 1)


def name_group(linear: np.ndarray) -> str:
    """Return the name of a tone's group, by its typology angle."""
    lightness, _, yellow = to_lab(linear)
    angle = np.degrees(np.arctan2(lightness - 50, yellow))
    return next(name for least, name in TYPOLOGY_GROUPS if angle > least)


@cache
def read_population() -> Population:
    stored = {name: np.array(value) for name, value in json.loads(MODEL_FILE.read_text(encoding="utf-8")).items()}
    root = np.linalg.cholesky(stored["ratio_covariance"])
    tones, share, even = [], [], []
    for (red, red_weight), (blue, blue_weight) in itertools.product(QUADRATURE, repeat=2):
        ratios = np.exp(stored["ratios"] + root @ [red, blue])
        colours = np.stack([ratios[:, 0], np.ones(len(ratios)), ratios[:, 1]], -1)
        luminance = ((stored["lightness"] + 16) / 116) ** 3  # CIE L*, above 8
        tones.append(colours * (luminance / (colours @ LUMINANCE_WEIGHTS))[:, None])
        share.append(stored["share"] * red_weight * blue_weight)
        even.append(np.full(len(ratios), red_weight * blue_weight / len(ratios)))
    return Population(
        *map(np.concatenate, (tones, share, even)),
        stored["slope"],
        stored["offset"],
        stored["covariance"],
        float(stored["colour_sigma_l"]),
    )


def _expect(tones: np.ndarray, weight: np.ndarray, source: str, least_sigma_l: float) -> SkinTone:
    """Return the mean of tones [N, 3] of these probabilities [N] in L*a*b*, with its deviation, error and group."""
    lab = to_lab(tones)
    mean = weight @ lab
    linear = from_lab(mean)
    error = weight @ color.deltaE_ciede2000(lab, np.broadcast_to(mean, lab.shape))
    deviation = np.hypot(np.sqrt(weight @ np.square(lab[:, 0] - mean[0])), MIN_SIGMA_L)
    return SkinTone.from_linear(
        linear, source, deviation=float(max(deviation, least_sigma_l)), error=float(error), group=name_group(linear)
    )
