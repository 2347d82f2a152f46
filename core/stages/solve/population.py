# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimate the skin tone behind a person's look, and its uncertainty.

A picture's colour of skin is the tone times exposure and light. What cancels both is a white surface in the face's
light: the eyes' own whites, or a card. Each cue is a multivariate t distribution about what simulated phones make of
simulated people (`research.training tones`), heavy-tailed, for real pictures stray in ways that no simulation has. The
prior is kept apart from them: every lightness of measured facial skin alike, with the colours that skin of that
lightness has. A prior by the number of people would draw dark skin towards the middle.
How bright skin is in a picture counts where nothing white is seen, and where the whites are burnt out, which then bound
the tone from above: a phone exposes for the face. The surroundings do not count: they say little of the exposure.
"""

from __future__ import annotations

import itertools
import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.stats import t
from skimage import color

from ...imaging import images
from .look import LUMINANCE_WEIGHTS, Look, to_coordinates
from .skin_tone import COLOURLESS, EYES, SCENE, STRANGE, WHITE_POINT, SkinTone

DATA_FILES = ("weights/tones.json",)
MODEL_FILE = Path(__file__).parents[2] / DATA_FILES[0]
# of a white surface's brightness: what skin of any tone reflects without taking colour, and no view is free of
SHEEN_REFLECTANCE = 0.015
SHEEN_SIGMA_LOG = 0.5  # deviation of the sheen in log units: oily and dry skin
# deviation of the surface reflection that was taken off measured spectra: 2 to 4 %, of which the mean is 2.8
SURFACE_SIGMA = 0.006
# deviations in log units of a measured white: of its level (the face may be lit otherwise), and of its colour
MEASURED_SIGMA_LOG = 0.10, 0.025, 0.025
CUES = "skin", "over_white", "over_card"
FREEDOM = 8.0  # degrees of freedom of the cues' t distributions
# deviation of L* that is always stated: faces differ from their tone's mean in more ways than the model has
MIN_SIGMA_L = 1.5
# nodes and weights of a Gaussian's quadrature by three points (Gauss-Hermite)
QUADRATURE = (-np.sqrt(3), 1 / 6), (0.0, 2 / 3), (np.sqrt(3), 1 / 6)
# individual typology angle in degrees above which a tone is of a group (Chardon et al. 1991; Del Bino and Bernerd 2013)
TYPOLOGY_GROUPS = ((55, "very light"), (41, "light"), (28, "intermediate"), (10, "tan"), (-30, "brown"), (-91, "dark"))
COLOURLESS_LOG = 0.03  # ln R/G and ln B/G of skin below which a picture has no colour
STRANGE_DISTANCE = 5.0  # Mahalanobis distance of skin's colour from that of all tones beyond which it fits none


@dataclass(frozen=True)
class Cue:
    """What pictures show of a tone: slope [3, 3] times the coordinates of the tone with its sheen, plus offset [3].

    scale [3, 3]: scale matrix of the t distribution about it in even light; exp(growth times unevenness), growth [3],
    multiplies its variances: an uneven light spoils brightness more than colour.
    """

    slope: np.ndarray
    offset: np.ndarray
    scale: np.ndarray
    growth: np.ndarray

    def scale_in(self, unevenness: float) -> np.ndarray:
        """Return the scale matrix [3, 3] in a light."""
        root = np.exp(0.5 * self.growth * unevenness)
        return self.scale * np.outer(root, root)


@dataclass(frozen=True)
class Population:
    """Tones [N, 3], linear, their prior [N] and the cues.

    The cues are `skin`, as it is; `over_white`, skin around the eyes less their whites; `over_card`, skin less a card.
    """

    tones: np.ndarray
    prior: np.ndarray
    skin: Cue
    over_white: Cue
    over_card: Cue


def estimate_from_look(look: Look, source: str = SCENE) -> SkinTone:
    """Return the tone behind a look. Where its colours are not skin's, brightness alone counts."""
    people, eyes = read_population(), look.eyes
    odd = COLOURLESS if _is_colourless(look) else STRANGE if _is_strange(people, look) else None
    rows, log = slice(1) if odd else slice(None), 0
    if eyes is None or eyes.burnt:
        log = _log_likelihood(*_apart(people, people.skin, look.skin, people.skin.scale_in(look.unevenness), rows))
    if eyes is not None:
        scale, source = people.over_white.scale_in(eyes.unevenness), EYES
        if eyes.burnt:
            away, matrix = _apart(people, people.over_white, eyes.over_white, scale, slice(1))
            log = log + t.logcdf(away[:, 0] / np.sqrt(matrix[:, 0, 0]), FREEDOM)
        else:
            log = _log_likelihood(*_apart(people, people.over_white, eyes.over_white, scale, rows))
    return _expect(people, log, odd or source)


def estimate_from_white(look: Look, white: np.ndarray) -> SkinTone:
    """Return the tone behind a look, by the linear colour [3] of a white surface before the face."""
    people = read_population()
    scale = people.over_card.scale_in(look.unevenness) + np.diag(np.square(MEASURED_SIGMA_LOG))
    log = _log_likelihood(*_apart(people, people.over_card, look.skin - to_coordinates(white), scale))
    return _expect(people, log, WHITE_POINT)


def _is_colourless(look: Look) -> bool:
    return bool(np.abs(look.skin[1:]).max() < COLOURLESS_LOG)


def _is_strange(people: Population, look: Look) -> bool:
    """Return True if no usual light and camera make this colour of any skin."""
    away, matrix = _apart(people, people.skin, look.skin, people.skin.scale_in(look.unevenness), slice(1, 3))
    return bool(_squares(away, matrix).min() > STRANGE_DISTANCE**2)


def _apart(
    people: Population, cue: Cue, coordinates: np.ndarray, scale: np.ndarray, rows: slice = slice(None)
) -> tuple[np.ndarray, np.ndarray]:
    """Return how far `rows` of what a cue shows lie from each tone [N, R], and the scale matrices [N, R, R] of that."""
    of_tones = to_coordinates(people.tones + SHEEN_REFLECTANCE)
    away = coordinates - of_tones @ cue.slope.T - cue.offset  # [N, 3]
    # on dark skin sheen is much of what is seen
    shiny = to_coordinates(people.tones + SHEEN_REFLECTANCE * np.exp(SHEEN_SIGMA_LOG)) - of_tones
    shiny = shiny @ cue.slope.T
    matrix = scale + shiny[:, :, None] * shiny[:, None, :]
    return away[:, rows], matrix[:, rows, rows]


def _squares(away: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return the squares [N] of distances [N, R] by scale matrices [N, R, R]."""
    return np.einsum("ni,nij,nj->n", away, np.linalg.inv(matrix), away)


def _log_likelihood(away: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return the log likelihood [N] of the tones by how far they lie apart [N, R] from what is shown."""
    logs = (FREEDOM + away.shape[1]) * np.log1p(_squares(away, matrix) / FREEDOM)
    return -0.5 * (logs + np.linalg.slogdet(matrix)[1])


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
    stored = json.loads(MODEL_FILE.read_text(encoding="utf-8"))
    lightness, mean = np.array(stored["lightness"]), np.array(stored["ratios"])
    root = np.linalg.cholesky(stored["ratio_covariance"])
    tones, prior = [], []
    for (red, red_weight), (blue, blue_weight) in itertools.product(QUADRATURE, repeat=2):
        ratios = np.exp(mean + root @ [red, blue])
        colours = np.stack([ratios[:, 0], np.ones(len(ratios)), ratios[:, 1]], -1)
        luminance = ((lightness + 16) / 116) ** 3  # CIE L*, above 8
        tones.append(colours * (luminance / (colours @ LUMINANCE_WEIGHTS))[:, None])
        prior.append(np.full(len(ratios), red_weight * blue_weight / len(ratios)))
    cues = {name: Cue(**{part: np.array(value) for part, value in stored[name].items()}) for name in CUES}
    return Population(np.concatenate(tones), np.concatenate(prior), **cues)


def _expect(people: Population, log: np.ndarray, source: str) -> SkinTone:
    """Return the mean of the tones in L*a*b* under log likelihoods [N], with its deviation, error and group."""
    weight = people.prior * np.exp(log - log.max())
    weight /= weight.sum()
    lab = to_lab(people.tones)
    mean = weight @ lab
    linear = from_lab(mean)
    error = weight @ color.deltaE_ciede2000(lab, np.broadcast_to(mean, lab.shape))
    surface = SURFACE_SIGMA * 116 / 3 * (linear @ LUMINANCE_WEIGHTS) ** (-2 / 3)  # of L*, by its slope
    deviation = np.linalg.norm([np.sqrt(weight @ np.square(lab[:, 0] - mean[0])), surface, MIN_SIGMA_L])
    return SkinTone.from_linear(
        linear, source, deviation=float(deviation), error=float(error), group=name_group(linear)
    )
