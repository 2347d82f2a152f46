# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Import of a mask painted in another program: any size and bit depth, white is shadow, soft edges are kept."""

from __future__ import annotations

from pathlib import Path

from ..capture import mask_history
from ..capture.capture import Capture
from ..capture.messages import Problem
from ..settings.settings import Settings
from . import images

MOST_STRETCH_RATIO = 1.02
"""Tolerated difference between the two scales: a pixel of rounding at 64 texels."""


def import_mask(capture: Capture, picture: Path) -> Path:
    """Write shadow_mask.png (8 bit grey, at the texture's size) from a picture, and return its path.

    The previous mask goes to mask_history/. Raises Problem if there is no capture or picture, or if the picture's shape
    differs from the texture's.
    """
    if not capture.json.is_file():
        raise Problem(f"There is no capture at {capture.root}.", "Choose a folder that ends in .wildcap.")
    if not Path(picture).is_file():
        raise Problem(f"There is no picture at {picture}.", "Check the path.")
    mask = images.read_mask(picture)
    width, height = images.size(capture.texture_png) if capture.texture_png.is_file() else [Settings().texture.size] * 2
    across, down = mask.shape[1] / width, mask.shape[0] / height
    if max(across, down) > MOST_STRETCH_RATIO * min(across, down):
        raise Problem(
            f"{picture} is {mask.shape[1]} x {mask.shape[0]}, but the texture is {width} x {height}.",
            "Paint the mask on the capture's texture.png, without cropping it.",
        )
    if mask.shape != (height, width):
        mask = images.resize(mask, width, height)
    mask_history.keep(capture, capture.shadow_mask)
    images.write_data(capture.shadow_mask, mask.clip(0, 1))
    return capture.shadow_mask
