# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the sun does not reach, told by the texture as it was filmed: for delighters that do not say where they saw a
shadow.

The light of core/light/sunlight.py, a sky and a sun, is fitted to the skin; each texel is then lit by both or by the
sky alone.
"""

from __future__ import annotations

import numpy as np

from ...capture.messages import Reporter
from ...face.head import Unfolded
from ...geometry.raster import interpolate
from ...light.sunlight import fit_light, log_likelihood
from .tidy import cohere

FIT_TEXELS = 1200  # of skin that the light is fitted to
FEWEST_TEXELS = 200  # texels of skin under which nothing is fitted
OFF_M = 1e-3  # how far rays start off the surface
# how often a texel is sunlit that the head itself hides from the sun, and that it does not
SUNLIT_PROBABILITIES = 0.05, 0.65


def out_of_sun(
    filmed: np.ndarray,
    transfer: np.ndarray,
    head: Unfolded,
    judged: np.ndarray,
    skin: np.ndarray,
    sensitivity: float,
    report: Reporter,
) -> np.ndarray:
    """Texels that the sun does not reach.

    Parameters
    ----------
    filmed : [S, S, 3], linear
    transfer : [V, 9], `radiance_transfer` of the head's vertices
    head : unfolded
    judged : bool [S, S], what is looked at
    skin : bool [S, S], plain skin
    sensitivity : in [0, 1]
    report : hears of progress

    Returns
    -------
    bool [S, S]; nowhere where no sun shows.
    """
    colours = filmed[head.covered].astype(float)
    at = interpolate(transfer, head.mesh.faces, head.face[head.covered], head.bary[head.covered])
    drawn = np.flatnonzero((judged & skin)[head.covered] & (colours.min(1) > 1e-3))
    if len(drawn) < FEWEST_TEXELS:
        return np.zeros_like(judged)
    drawn = drawn[:: max(1, len(drawn) // FIT_TEXELS)]
    light, _, _ = fit_light(
        colours[drawn],
        head.normals[drawn],
        at[drawn],
        lambda sun: _sees(head, drawn, sun),
        np.ones(len(drawn)),
        lambda done, of: report.progress(2 * of + 3 * done, 8 * of, "Fitting the light"),
    )
    if not light.has_sun:
        return np.zeros_like(judged)
    log, ambient = np.log(np.maximum(colours, 1e-4)), light.ambient(at)
    likely = log_likelihood(log - np.log(ambient)) - log_likelihood(log - np.log(ambient + light.direct(head.normals)))
    sunlit = SUNLIT_PROBABILITIES[0] + (SUNLIT_PROBABILITIES[1] - SUNLIT_PROBABILITIES[0]) * _sees(
        head, np.arange(len(head.points)), light.sun
    )
    odds = head.spread(np.clip(likely + 6 * (sensitivity - 0.5), -12, 12) - np.log(sunlit / (1 - sunlit)))
    return cohere(np.where(skin, odds, 0), judged)  # what is not skin follows its neighbours


def _sees(head: Unfolded, texels: np.ndarray, sun: np.ndarray) -> np.ndarray:
    """[N] 0 or 1: whether the head leaves the sun visible from these of its covered texels."""
    facing = texels[head.normals[texels] @ sun > 0]
    free = np.zeros(len(head.points))
    free[facing] = ~head.caster.blocked(
        head.points[facing] + OFF_M * head.normals[facing], np.repeat(sun[None], len(facing), 0)
    )
    return free[texels]
