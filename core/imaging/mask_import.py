# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture painted elsewhere becomes the capture's shadow mask: any size and bit depth, white is shadow, soft edges
stay."""

from __future__ import annotations

from pathlib import Path

from ..capture import mask_history
from ..capture.capture import Capture
from ..capture.messages import Problem
from ..settings.settings import Settings
from . import images

MOST_STRETCH_RATIO = 1.02
"""How much more a mask may grow one way than the other: a pixel lost to rounding at 64 texels, not a picture of another
shape."""


def import_mask(capture: Capture, picture: Path) -> Path:
    """Writes shadow_mask.png (8 bit grey, at the texture's size) from `picture`; the mask before it goes to
    mask_history/.

    Returns the mask's path. Raises Problem for what is no picture, one of another shape than the texture's, or no
    capture, or when the folder cannot be written.
    """
    if not capture.json.is_file():
        raise Problem(f"There is no capture at {capture.root}.", "Choose a folder that ends in .wildcap.")
    if not Path(picture).is_file():
        raise Problem(f"There is no picture at {picture}.", "Check its name.")
    mask = images.read_mask(picture)
    width, height = _texture_size(capture)
    across, down = mask.shape[1] / width, mask.shape[0] / height
    if max(across, down) > MOST_STRETCH_RATIO * min(across, down):
        raise Problem(
            f"{picture} is {mask.shape[1]} x {mask.shape[0]}, but the texture is {width} x {height}: it "
            "would be stretched.",
            "Paint the mask on the capture's texture.png, without cropping it.",
        )
    if mask.shape != (height, width):
        mask = images.resize(mask, width, height)
    mask_history.keep(capture, capture.shadow_mask)
    images.write_data(capture.shadow_mask, mask.clip(0, 1))
    return capture.shadow_mask


def _texture_size(capture: Capture) -> tuple[int, int]:
    if not capture.texture_png.is_file():
        return Settings().texture.size, Settings().texture.size
    return images.size(capture.texture_png)
