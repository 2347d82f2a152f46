# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a portrait as a fit to the registered head would find it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.light.spherical_harmonics import sh_basis

from .environments import Environment
from .olat import BASIS, LIGHTS


@dataclass(frozen=True)
class FittedLight:
    """The light as a fit to the registered head would find it, up to its usual errors, times the skin's tone: ambient
    [P, 3] of a second-order sky, sunlit [P, 3] the same and a sun that only the head itself blocks; smooth normals [P,
    3] of the registered head."""

    ambient: np.ndarray
    sunlit: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True)
class LampOnHead:
    """A lamp as it falls on a head: towards [3], unit direction to it; colour [3]: irradiance over pi; reach [P]: what
    the head itself lets through of it."""

    towards: np.ndarray
    colour: np.ndarray
    reach: np.ndarray


def fitted_light(
    transfer: np.ndarray,
    smooth: np.ndarray,
    lamps: list[LampOnHead],
    environment: Environment,
    tone: np.ndarray,
    rng: np.random.Generator,
) -> FittedLight:
    """What core/light/sunlight.py would find, without its search: the second-order sky and the strongest lamp, each a
    little off.

    Parameters
    ----------
    transfer : [P, 9] of the head
    smooth : [P, 3], its normals without pores
    lamps : those beside the environment
    environment : the light from everywhere
    tone : [3], of the exposed skin
    rng : of the fit's errors
    """
    main = int(np.argmax([lamp.colour.mean() for lamp in lamps])) if lamps else -1
    sky = BASIS.T @ environment.radiance * (4 * np.pi / LIGHTS)
    for k, lamp in enumerate(lamps):
        if k != main:
            sky = sky + sh_basis(lamp.towards)[:, None] * lamp.colour * np.pi
    found = main >= 0 and rng.random() < 0.85
    if main >= 0 and not found:
        sky = sky + sh_basis(lamps[main].towards)[:, None] * lamps[main].colour * np.pi
    sky = sky * np.exp(rng.normal(0, 0.1, 3)) + rng.normal(0, 0.08, sky.shape) * np.abs(sky[:1])
    lit = transfer @ sky
    lit = np.maximum(lit, 0.15 * np.median(lit, 0))
    normal = smooth + rng.normal(0, 0.05, 3)
    normal = (normal / np.sqrt(np.einsum("ij,ij->i", normal, normal))[:, None]).astype(np.float32)
    tone = tone * np.exp(rng.normal(0, 0.08) + rng.normal(0, 0.03, 3))
    sunlit = lit
    if found:
        towards = lamps[main].towards + rng.normal(0, 0.06, 3)
        towards /= np.linalg.norm(towards)
        strength = np.exp(rng.normal(0, 0.15) + rng.normal(0, 0.05, 3))
        direct = np.maximum(normal @ towards, 0)[:, None] * lamps[main].colour * strength
        sunlit = lit + direct * lamps[main].reach[:, None]
    return FittedLight(*((shading * tone).astype(np.float32) for shading in (lit, sunlit)), normal)
