# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frame before and after delighting, with a wipe between them.

The wipe is an icon, so that no data-block stays behind. Its frame is read by the operator, not while a panel is drawn.
"""

from pathlib import Path

import bpy
import bpy.utils.previews
import numpy as np

from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from ...core.capture.stages import advise_again
from .. import colours
from ..data_blocks import read_pixels

SIDE_PX = 256
"""Side of the square icon, pixels."""

_icons: bpy.utils.previews.ImagePreviewCollection | None = None
# capture folder, frame, and the frame before and after [SIDE_PX, SIDE_PX, 4], rows from below
_pair: tuple[str, str, np.ndarray, np.ndarray] | None = None


def frames(capture: Capture) -> list[str]:
    """Return the names of the delit frames."""
    return sorted(path.stem for path in capture.delit.glob("*.png"))


def show(capture: Capture, index: int, wipe: float) -> None:
    """Show a frame before and after delighting. `index` wraps around. Raises Problem if no frame was delit."""
    global _pair
    frame_names = frames(capture)
    if not frame_names:
        raise Problem("No frame has been delit yet.", "Click Reconstruct: Delight is one of its stages.")
    name = frame_names[index % len(frame_names)]
    before = next(capture.frames.glob(f"{name}.*"), None)
    if before is None:
        raise Problem(f"The frame {name} is missing from this capture.", advise_again("frames"))
    _pair = str(capture.root), name, _read(before), _read(capture.delit / f"{name}.png")
    move(wipe)


def shown_frame(capture: Capture) -> str:
    """Return the name of the frame that the wipe shows for this capture, '' for none."""
    return _pair[1] if _pair is not None and _pair[0] == str(capture.root) else ""


def move(wipe: float) -> None:
    """Move the edge between before (left) and after to `wipe` of the width, marked by a white line."""
    global _icons
    if _pair is None:
        return
    if _icons is None:
        _icons = bpy.utils.previews.new()
    picture = _icons.get("wipe") or _icons.new("wipe")
    picture.image_size = SIDE_PX, SIDE_PX
    before, after = _pair[2:]
    edge = round(wipe * SIDE_PX)
    mixed = np.concatenate([before[:, :edge], after[:, edge:]], 1)  # [SIDE_PX, SIDE_PX, 4]
    if 0 < edge < SIDE_PX:
        mixed[:, edge - 1 : edge + 1, :3] = 1
    picture.image_pixels_float.foreach_set(mixed.ravel())


def icon() -> int:
    return _icons["wipe"].icon_id


def forget() -> None:
    """Drop the pictures."""
    global _icons, _pair
    if _icons is not None:
        bpy.utils.previews.remove(_icons)
    _icons = _pair = None


def _read(path: Path) -> np.ndarray:
    """Read a picture as sRGB, fitted into a transparent square [SIDE_PX, SIDE_PX, 4]."""
    image = bpy.data.images.load(str(path))
    colours.as_data(image)  # or Blender would linearise pictures of 16 bits, but not of 8
    try:
        scale = SIDE_PX / max(1, *image.size)
        image.scale(max(1, round(image.size[0] * scale)), max(1, round(image.size[1] * scale)))
        pixels = read_pixels(image)
    finally:
        bpy.data.images.remove(image)
    square = np.zeros((SIDE_PX, SIDE_PX, 4), np.float32)
    height, width = pixels.shape[:2]
    left, low = (SIDE_PX - width) // 2, (SIDE_PX - height) // 2
    square[low : low + height, left : left + width, :3] = pixels[..., :3]
    square[low : low + height, left : left + width, 3] = 1
    return square
