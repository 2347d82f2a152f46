# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how glossy the solved skin is: materials divide the specular map by its mean on cheeks and forehead."""

from __future__ import annotations

import numpy as np

from ...face import template

WITHOUT = ("nose", "eyes", "brows", "lips", "nostrils")


def on_cheeks_and_forehead(specular: np.ndarray, confidence: np.ndarray) -> float:
    """Return the mean specular albedo there under a confidence [S, S], or over all of it if nothing was seen."""
    size = len(specular)
    where = template.mask("skin", size) > 0.5
    for name in WITHOUT:
        where &= template.mask(name, size) < 0.5
    lips = template.mask("lips", size).sum(1)
    where[int(np.average(np.arange(size), weights=lips)) :] = False  # a chin is neither
    seen = where * confidence
    return float(np.average(specular, weights=seen if seen.sum() > 0 else where))
