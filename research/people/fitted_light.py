# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a portrait as a fit to the registered head would return it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.light.spherical_harmonics import sh_basis

from .environments import Environment


@dataclass(frozen=True)
class FittedLight:
    """Shading of the registered head, with the errors of a fit, times the skin's tone.

    ambient [P, 3]: of a second-order sky; sunlit [P, 3]: with a sun that only the head itself blocks; normal [P, 3]:
    smooth normals.
    """

    ambient: np.ndarray
    sunlit: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True)
class LampOnHead:
    """A lamp on a head: unit direction `towards` [3], colour [3] (irradiance / pi), share `reach` [P] past the head."""

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
    """Draw the answer of core/light/sunlight.py without its search: sky and strongest lamp, each a little off.

    transfer [P, 9] and smooth normals [P, 3] of the head; lamps beside the environment; tone [3] of the exposed skin.
    """
    main = max(lamps, key=lambda lamp: lamp.colour.mean(), default=None)
    sun = main if main and rng.random() < 0.85 else None
    sky = environment.sky
    for lamp in sorted(lamps, key=lambda lamp: lamp is main):
        if lamp is not sun:
            sky = sky + sh_basis(lamp.towards)[:, None] * lamp.colour * np.pi
    sky = sky * np.exp(rng.normal(0, 0.1, 3)) + rng.normal(0, 0.08, sky.shape) * np.abs(sky[:1])
    lit = transfer @ sky
    lit = np.maximum(lit, 0.15 * np.median(lit, 0))
    normal = smooth + rng.normal(0, 0.05, 3)
    normal = (normal / np.sqrt(np.einsum("ij,ij->i", normal, normal))[:, None]).astype(np.float32)
    tone = tone * np.exp(rng.normal(0, 0.08) + rng.normal(0, 0.03, 3))
    sunlit = lit
    if sun:
        towards = sun.towards + rng.normal(0, 0.06, 3)
        towards /= np.linalg.norm(towards)
        strength = np.exp(rng.normal(0, 0.15) + rng.normal(0, 0.05, 3))
        direct = np.maximum(normal @ towards, 0)[:, None] * sun.colour * strength
        sunlit = lit + direct * sun.reach[:, None]
    return FittedLight(*((shading * tone).astype(np.float32) for shading in (lit, sunlit)), normal)
