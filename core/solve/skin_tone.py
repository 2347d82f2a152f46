# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The skin tone as a value: read once from the settings or estimated once, and from there on handed from function to
function."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from ..contract.messages import Problem
from ..imaging import images

GIVEN, SCENE, WHITE_POINT, TEXTURE, EARLIER = "given", "scene", "white point", "texture", "earlier solve"
"""Where a tone comes from: the settings; an estimate from the frames as they were filmed, or with a measured white; one
from the texture; the solve before."""
DECIMALS = 5
"""Of sRGB, in a setting and in an estimate from the frames: who types the tone that was estimated gets the same
maps."""


@dataclass(frozen=True)
class SkinTone:
    """The mean albedo of a person's facial skin.

    linear: linear sRGB [3] in (0, 1], numbers of float32. source: where it comes from. Of an estimate from the frames,
    else None: deviation, one standard deviation of the lightness L*; error, the expected colour difference, delta E
    2000; group, what such a tone is called (population.GROUPS).
    """

    linear: tuple[float, float, float]
    source: str
    deviation: float | None = None
    error: float | None = None
    group: str | None = None

    @classmethod
    def from_linear(cls, linear: np.ndarray | torch.Tensor, source: str, **other_fields) -> SkinTone:
        """Of linear sRGB [3]; `other_fields` are the other fields."""
        return cls(tuple(float(value) for value in np.asarray(linear, np.float32)), source, **other_fields)

    @classmethod
    def from_srgb(cls, srgb: np.ndarray | list[float], source: str, **other_fields) -> SkinTone:
        """Of encoded sRGB [3] in (0, 1]."""
        return cls.from_linear(images.srgb_to_linear(np.asarray(srgb, np.float32)), source, **other_fields)

    @property
    def srgb(self) -> np.ndarray:
        """Encoded sRGB, float32 [3]."""
        return images.linear_to_srgb(np.array(self.linear, np.float32))

    @property
    def tensor(self) -> torch.Tensor:
        """`linear` as float32 [3]."""
        return torch.tensor(self.linear)


def parse_skin_tone(setting: str) -> SkinTone | None:
    """settings.solve.skin_tone: 'R,G,B', sRGB in 0..1, or None for 'auto'. Raises Problem for what is neither."""
    if setting == "auto":
        return None
    try:
        channels = [float(text) for text in setting.split(",")]
    except ValueError:
        channels = []
    if len(channels) != 3 or not all(0 < v <= 1 for v in channels):
        raise Problem(f"The skin tone {setting!r} is not a colour.",
                      "Give three numbers between 0 and 1 as sRGB, such as 0.69,0.54,0.45, or auto.")
    return SkinTone.from_srgb(channels, GIVEN)


def format_skin_tone(tone: SkinTone) -> str:
    """The setting that `parse_skin_tone` reads as this tone."""
    return ",".join(f"{value:.{DECIMALS}f}" for value in tone.srgb)
