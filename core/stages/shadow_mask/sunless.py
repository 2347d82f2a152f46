# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Texels that the sun does not reach, by the filmed texture: for delighters that do not report shadows.

A sky and a sun (core/light/sunlight.py) are fitted to the skin; each texel is then lit by both or by the sky alone.
"""

from __future__ import annotations

import numpy as np

from ...capture.messages import Reporter
from ...face.head import Unfolded
from ...geometry.raster import interpolate
from ...geometry.visibility import reached_by_sun
from ...light.sunlight import fit_light, log_likelihood
from .tidy import cohere

FIT_TEXELS = 1200  # of skin that the light is fitted to
FEWEST_TEXELS = 200  # with fewer nothing is fitted
SUNLIT_PROBABILITIES = 0.05, 0.65  # of texels that the head itself hides from the sun, and of the others


def out_of_sun(
    filmed: np.ndarray,
    transfer: np.ndarray,
    head: Unfolded,
    judged: np.ndarray,
    skin: np.ndarray,
    sensitivity: float,
    report: Reporter,
) -> np.ndarray:
    """Return the texels, bool [S, S], that the sun does not reach; none if there is no sun.

    filmed: linear [S, S, 3]; transfer [V, 9]: `radiance_transfer` of the head's vertices; judged: bool [S, S], texels
    to decide on; skin: bool [S, S], plain skin.
    """
    colours = filmed[head.covered].astype(float)
    transfer = interpolate(transfer, head.mesh.faces, head.face[head.covered], head.bary[head.covered])
    fit = np.flatnonzero((judged & skin)[head.covered] & (colours.min(1) > 1e-3))
    if len(fit) < FEWEST_TEXELS:
        return np.zeros_like(judged)
    fit = fit[:: max(1, len(fit) // FIT_TEXELS)]
    light, _, _ = fit_light(
        colours[fit],
        head.normals[fit],
        transfer[fit],
        lambda sun: reached_by_sun(head.caster, head.points[fit], head.normals[fit], sun).astype(float),
        np.ones(len(fit)),
        lambda done, of: report.progress(2 * of + 3 * done, 8 * of, "Fitting the light"),
    )
    if not light.has_sun:
        return np.zeros_like(judged)
    log, ambient = np.log(np.maximum(colours, 1e-4)), light.ambient(transfer)
    sunlit = ambient + light.direct(head.normals)
    likely = log_likelihood(log - np.log(ambient)) - log_likelihood(log - np.log(sunlit))
    low, high = SUNLIT_PROBABILITIES
    prior = low + (high - low) * reached_by_sun(head.caster, head.points, head.normals, light.sun)
    odds = head.spread(np.clip(likely + 6 * (sensitivity - 0.5), -12, 12) - np.log(prior / (1 - prior)))
    return cohere(np.where(skin, odds, 0), judged)  # other texels than plain skin follow their neighbours
