# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Skin tone as a value, read once from the settings or estimated once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from ...imaging import images
from ...settings import colour_values

# sources of a tone: the settings; an estimate from the frames as they were filmed, by the whites of the eyes, or with a
# measured white; one from frames without colour, or of colours that no skin has; one from the texture; the solve before
GIVEN, SCENE, EYES, WHITE_POINT = "given", "scene", "whites of the eyes", "white point"
COLOURLESS, STRANGE = "no colour", "strange colours"
TEXTURE, EARLIER = "texture", "earlier solve"


@dataclass(frozen=True)
class SkinTone:
    """Mean albedo of a person's facial skin, to as many decimals as a setting has (colour_values.TONE_DECIMALS).

    linear: linear sRGB [3] in (0, 1], numbers of float32. Of an estimate from the frames, else None: deviation, one
    standard deviation of the lightness L*; error, the expected colour difference, delta E 2000; group, the name of such
    tones (population.TYPOLOGY_GROUPS). Of a tone that was given: estimate, what the pictures tell, if they do.
    """

    linear: tuple[float, float, float]
    source: str
    deviation: float | None = None
    error: float | None = None
    group: str | None = None
    estimate: SkinTone | None = None

    @classmethod
    def from_linear(cls, linear: np.ndarray | torch.Tensor, source: str, **other_fields) -> SkinTone:
        """Return the tone of linear sRGB [3]."""
        return cls.from_srgb(images.linear_to_srgb(np.asarray(linear, np.float32)), source, **other_fields)

    @classmethod
    def from_srgb(cls, srgb: np.ndarray | Sequence[float], source: str, **other_fields) -> SkinTone:
        """Return the tone of encoded sRGB [3] in (0, 1]."""
        rounded = [round(float(channel), colour_values.TONE_DECIMALS) for channel in srgb]
        linear = images.srgb_to_linear(np.array(rounded, np.float32))
        return cls(tuple(map(float, linear)), source, **other_fields)

    @property
    def srgb(self) -> np.ndarray:
        """Encoded sRGB, float32 [3]."""
        return images.linear_to_srgb(np.array(self.linear, np.float32))

    @property
    def tensor(self) -> torch.Tensor:
        """`linear` as float32 [3]."""
        return torch.tensor(self.linear)


def read_given_tone(setting: str) -> SkinTone | None:
    """Return the tone of settings.solve.skin_tone, None for auto and for a swatch, whose hue is the person's.

    Raises Problem if it is none of these.
    """
    srgb = colour_values.parse_skin_tone(setting)
    return SkinTone.from_srgb(srgb, GIVEN) if isinstance(srgb, tuple) else None
