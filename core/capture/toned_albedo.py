# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Albedo in another skin tone: its skin times a gain, by a weight that leaves hair as it is.

The worker's arrays and Blender's alike: only their own arithmetic is used.
"""

from __future__ import annotations

from ..settings.colour_values import LUMINANCE_WEIGHTS

DARK_HAIR, BRIGHT_HAIR = 0.05, 0.6
"""Linear luminance of brown to black and of white hair, each as a texel of nothing else."""
DARK_HAIR_OF_SKIN, LIGHT_SKIN = 0.3, 1.3
"""Luminance of the hair of dark people at most, and of the lightest skin in a face, as shares of the skin tone's."""


def weigh_hair(albedo, zone, skin):
    """Return how far each place follows the skin tone, [...] in [0, 1], where hair may lie.

    Linear albedo [..., 3] of hair with skin between: the share of hair tells how much of a place's brightness is the
    skin's, which alone follows; so dense hair stays as it is, and thin brows stay darker than any skin. `zone` [...] in
    [0, 1]: how probable hair is; `skin`: linear skin tone [3]. Arrays of any library.
    """
    here, usual = _luminance(albedo), _luminance(skin)
    dark, lightest = min(DARK_HAIR, DARK_HAIR_OF_SKIN * usual), LIGHT_SKIN * usual
    of_dark = ((usual - here) / (usual - dark)).clip(0, 1) * dark
    of_bright = ((here - lightest) / max(BRIGHT_HAIR - lightest, 0.1)).clip(0, 1) * BRIGHT_HAIR
    return (1 - zone * (of_dark + of_bright) / here.clip(dark, None)).clip(0, 1)


def _luminance(linear):
    return sum(weight * linear[..., band] for band, weight in enumerate(LUMINANCE_WEIGHTS))


def apply_tone(albedo, weight, gain):
    """Return linear albedo [..., 3] with its skin, by a weight [..., 1] in [0, 1], brought to another tone; at most 1.

    Arrays of any library that has their arithmetic; the node group WildCap Skin does the same.
    """
    toned = albedo * (1 + weight * (gain - 1))
    return toned.clip(0, 1)
