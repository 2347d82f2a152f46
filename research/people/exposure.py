# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A phone's view of a lit face: surroundings, metered exposure, and the cast that white balance leaves.

The meter weighs the face, in some phones nothing else, against the surroundings and holds the brightest skin below
white, so the brightness of skin in a picture says little of the skin. The light is a black body's; automatic white
balance takes most of its colour out and errs by a few degrees (recovery errors: Gijsenij, Gevers and van de Weijer,
"Computational color constancy", 2011).
"""

from __future__ import annotations

import numpy as np

from .pigment import LUMINANCE

SURFACES = 14  # in view beside the person
MIDDLE_GREY = 0.18  # linear reflectance that a meter takes for the scene's mean


def phone_exposure(rng: np.random.Generator, skin: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Draw a phone's gain of scene light, linear [3]: exposure times the remaining cast.

    skin [N, 3]: linear colours; light [3]: mean colour of the light on a white surface.
    """
    cast = _cast(rng)
    reflectance = np.clip(
        np.exp(rng.normal(np.log(0.2), 0.8, (SURFACES, 1)) + rng.normal(0, 0.25, (SURFACES, 3))), 0.02, 0.9
    )
    # it is rarely as light behind a person as on the face
    elsewhere = np.exp(rng.normal(0, 0.45)) * np.exp(rng.normal(0, 0.4, (SURFACES, 1)))
    behind = reflectance * elsewhere * light * np.exp(rng.normal(0, 0.06, 3))
    share = rng.dirichlet(np.ones(SURFACES))[:, None]
    face = rng.uniform(0.25, 1.0)  # weight of the face in the meter
    metered = face * float((skin @ LUMINANCE).mean()) + (1 - face) * float((share * behind).sum(0) @ LUMINANCE)
    level = MIDDLE_GREY * 2 ** rng.normal(0.5, 0.5) / metered
    level = min(level, rng.uniform(0.85, 1.15) / float(np.percentile((skin * cast).max(1), 98)))
    return level * cast


def _cast(rng: np.random.Generator) -> np.ndarray:
    """Draw the linear gain [3] of luminance about 1 that light and white balance leave on a white surface."""
    kelvin = np.exp(rng.uniform(np.log(2600), np.log(9000)))
    remaining = rng.uniform(0.0, 0.35)  # of the light's colour
    cast = _black_body(kelvin) ** remaining * np.exp(rng.normal(0, [0.05, 0.02, 0.06]))
    return cast / (cast @ LUMINANCE)


def _black_body(kelvin: float) -> np.ndarray:
    """Return a black body's linear RGB [3] over one of 6500 K, green 1, at one wavelength a channel (Planck's law)."""
    nanometres = np.array([605.0, 545.0, 460.0])
    radiance = 1 / (np.exp(1.4388e7 / (nanometres * kelvin)) - 1) * (np.exp(1.4388e7 / (nanometres * 6500)) - 1)
    return radiance / radiance[1]
