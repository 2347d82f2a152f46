# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour of a neck that nobody saw, as measured necks have it beside their faces.

The prior's mean face has one neck for everybody. Measured ones are less red than the face where skin is light, and
darker where it is dark (`research.training tones`). No ears' tops and no scalps were measured: these stay the mean
face's.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import cv2
import numpy as np

from ..imaging.normalized_convolution import weighted_blur
from ..settings.colour_values import LUMINANCE_WEIGHTS
from . import template

DATA_FILES = ("weights/tones.json",)
MODEL_FILE = Path(__file__).parents[1] / DATA_FILES[0]
MIDDLE_L = 50.0  # L* of a face about which the figures are given
FADE_SHARE = 0.08  # of the map's side, over which a face becomes a neck: no jaw is a drawn line
DARKEST_LINEAR = 1e-3  # albedo below which a logarithm says nothing


def expect_neck(tone: np.ndarray) -> np.ndarray:
    """Return the mean linear neck [3] of people of a linear facial tone [3]."""
    lightness = 116 * np.cbrt(np.dot(tone, LUMINANCE_WEIGHTS)) - 16  # CIE L*, above 8
    gain, slope = _read_figures()
    return tone * np.exp(gain + slope * (lightness - MIDDLE_L))


def neck_gain(albedo: np.ndarray, tone: np.ndarray, unseen: np.ndarray) -> np.ndarray:
    """Return the gain, float32 [S, S, 3], that gives the unseen part of a neck the colour that is expected of it.

    albedo [S, S, 3]: linear, of a facial tone [3]; unseen [S, S] in [0, 1]. Where it is 0, and on the face, the gain is
    1.
    """
    size, inside = len(albedo), template.mask("neck", len(albedo)) > 0.5
    width = FADE_SHARE * size
    away = cv2.distanceTransform(inside.astype(np.uint8), cv2.DIST_L2, 5)
    away -= cv2.distanceTransform((~inside).astype(np.uint8), cv2.DIST_L2, 5)
    weight = np.clip(0.5 + away / width, 0, 1) * unseen
    if weight.sum() < 1:
        return np.ones_like(albedo)
    own = weighted_blur(np.log(np.maximum(albedo, DARKEST_LINEAR)), weight * inside + 1e-6, width)
    return np.exp(weight[..., None] * (np.log(expect_neck(tone)) - own)).astype(np.float32)


@cache
def _read_figures() -> tuple[np.ndarray, np.ndarray]:
    """Return ln of a neck over its face at MIDDLE_L [3], and its slope by L* [3]."""
    stored = json.loads(MODEL_FILE.read_text(encoding="utf-8"))["neck"]
    return np.array(stored["log_gain"]), np.array(stored["log_gain_by_lightness"])
