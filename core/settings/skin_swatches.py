# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Ten numbered swatches of measured facial skin, 1 light to 10 dark, in the hue of one person.

Their lightness L* is spread evenly over the measured range. People of one lightness differ in hue: a person's departure
from the measured mean, in ln R/G and ln B/G, is carried to all ten. A tone becomes warmer as measured people do: by one
deviation of ln R/B among people of one lightness, with all that goes with it. Colours are encoded sRGB in (0, 1].
Standard library only.
"""

from __future__ import annotations

import json
import math
from bisect import bisect
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from .colour_values import LUMINANCE_WEIGHTS, SWATCHES, TONE_DECIMALS, Colour, to_linear

DATA_FILES = ("weights/tones.json",)
MODEL_FILE = Path(__file__).parents[1] / DATA_FILES[0]
WARMEST = 2.0
"""Deviations by which a tone may be made warmer or cooler than the person was filmed: 19 of 20 people lie within."""
SURE_SWATCHES = 3
"""Swatches that an estimate, one deviation to either side, may span without the artist being asked to choose."""
DARKEST_LINEAR = 1e-3
Hue = tuple[float, float]
"""ln R/G and ln B/G of linear light."""


@dataclass(frozen=True)
class _Measured:
    """Mean hue of facial skin by lightness L*, and how it changes by one deviation of ln R/B."""

    lightness: tuple[float, ...]
    hues: tuple[Hue, ...]
    warmer: Hue

    def mean_hue(self, lightness: float) -> Hue:
        """Return the mean hue of people of this lightness, by interpolation; beyond the ends, that of the end."""
        last = len(self.lightness) - 1
        i = min(max(bisect(self.lightness, lightness) - 1, 0), last - 1)
        span = self.lightness[i + 1] - self.lightness[i]
        share = min(max((lightness - self.lightness[i]) / span, 0.0), 1.0)
        return tuple(a + share * (b - a) for a, b in zip(self.hues[i], self.hues[i + 1], strict=True))


def make_swatches(person: Colour | None = None, warmth: float = 0.0) -> list[Colour]:
    """Return the ten swatches in the hue of a person's tone, or of the measured mean, warmer by so many deviations."""
    measured = _read()
    first, last = measured.lightness[-1], measured.lightness[0]
    levels = [first + (last - first) * i / (SWATCHES - 1) for i in range(SWATCHES)]
    return [_colour_of(level, _add(_usual_hue(level, person), measured.warmer, warmth)) for level in levels]


def nearest_swatch(colour: Colour) -> int:
    """Return the number of the swatch whose lightness is nearest."""
    lightness = find_lightness(colour)
    away = [abs(find_lightness(swatch) - lightness) for swatch in make_swatches()]
    return 1 + away.index(min(away))


def swatches_within(colour: Colour, deviation: float) -> list[int]:
    """Return the numbers of the swatches within `deviation` of the colour's lightness L*, at least the nearest."""
    lightness = find_lightness(colour)
    within = [i for i, swatch in enumerate(make_swatches(), 1) if abs(find_lightness(swatch) - lightness) <= deviation]
    return within or [nearest_swatch(colour)]


def is_unsure(deviation: float) -> bool:
    """Return whether an estimate of this deviation of L* leaves so much open that the artist is asked to choose."""
    lightness = _read().lightness
    return 2 * deviation > SURE_SWATCHES * (lightness[-1] - lightness[0]) / (SWATCHES - 1)


def find_warmth(colour: Colour, person: Colour | None = None) -> float:
    """Return by how many deviations of ln R/B a tone is warmer than the person was filmed."""
    (red, blue), (usual_red, usual_blue) = _hue_of(colour), _usual_hue(find_lightness(colour), person)
    warmer = _read().warmer
    return ((red - blue) - (usual_red - usual_blue)) / (warmer[0] - warmer[1])


def make_warmer(colour: Colour, deviations: float) -> Colour:
    """Return a tone of the same lightness, warmer by so many deviations; cooler if negative."""
    return _colour_of(find_lightness(colour), _add(_hue_of(colour), _read().warmer, deviations))


def find_lightness(colour: Colour) -> float:
    """Return CIE L* under D65 of a colour."""
    luminance = sum(w * v for w, v in zip(LUMINANCE_WEIGHTS, to_linear(colour), strict=True))
    return 116 * luminance ** (1 / 3) - 16 if luminance > (6 / 29) ** 3 else luminance * (29 / 3) ** 3


def _usual_hue(lightness: float, person: Colour | None) -> Hue:
    """Return the hue of people of this lightness who depart from the mean as the person does."""
    measured = _read()
    hue = measured.mean_hue(lightness)
    if person is None:
        return hue
    hue = _add(hue, _hue_of(person), 1.0)
    return _add(hue, measured.mean_hue(find_lightness(person)), -1.0)


def _hue_of(colour: Colour) -> Hue:
    red, green, blue = (math.log(max(v, DARKEST_LINEAR)) for v in to_linear(colour))
    return red - green, blue - green


def _colour_of(lightness: float, hue: Hue) -> Colour:
    """Return the colour of a lightness and hue; outside of sRGB, at its border."""
    luminance = ((lightness + 16) / 116) ** 3 if lightness > 8 else lightness / (29 / 3) ** 3
    ratios = math.exp(hue[0]), 1.0, math.exp(hue[1])
    scale = luminance / sum(w * ratio for w, ratio in zip(LUMINANCE_WEIGHTS, ratios, strict=True))
    return tuple(round(_encoded(min(max(scale * ratio, DARKEST_LINEAR), 1.0)), TONE_DECIMALS) for ratio in ratios)


def _add(hue: Hue, other: Hue, times: float) -> Hue:
    return hue[0] + times * other[0], hue[1] + times * other[1]


def _encoded(value: float) -> float:
    return 12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055


@cache
def _read() -> _Measured:
    stored = json.loads(MODEL_FILE.read_text(encoding="utf-8"))
    (red, both), (_, blue) = stored["ratio_covariance"]
    # regression of both ratios on ln R/B, whose variance among people of one lightness is red - 2 both + blue
    deviation = math.sqrt(red - 2 * both + blue)
    warmer = (red - both) / deviation, (both - blue) / deviation
    return _Measured(tuple(stored["lightness"]), tuple(map(tuple, stored["ratios"])), warmer)
