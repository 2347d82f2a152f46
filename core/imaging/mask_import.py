# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture painted elsewhere becomes the capture's shadow mask: any size and bit depth, white is shadow, soft edges stay."""

from __future__ import annotations

from pathlib import Path

from ..contract import mask_history
from ..contract.capture import Capture
from ..contract.messages import Problem
from ..contract.settings import Settings
from . import images


def import_mask(capture: Capture, picture: Path) -> Path:
    """Writes shadow_mask.png (8 bit grey, at the texture's size) from `picture`; the mask before it goes to mask_history/.

    Returns the mask's path. Raises Problem for what is no picture or no capture, or when the folder cannot be written.
    """
    if not capture.json.is_file():
        raise Problem(f"There is no capture at {capture.root}.", "Choose a folder that ends in .wildcap.")
    if not Path(picture).is_file():
        raise Problem(f"There is no picture at {picture}.", "Check its name.")
    mask = images.read_mask(picture)
    width, height = _texture_size(capture)
    if mask.shape != (height, width):
        mask = images.resize(mask, width, height)
    mask_history.keep(capture, capture.shadow_mask)
    images.write_data(capture.shadow_mask, mask.clip(0, 1))
    return capture.shadow_mask


def _texture_size(capture: Capture) -> tuple[int, int]:
    if not capture.texture_png.is_file():
        return Settings().texture.size, Settings().texture.size
    height, width = images.read_data(capture.texture_png).shape[:2]
    return width, height
