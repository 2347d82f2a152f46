# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a delighter did to a frame: before and after, with a wipe between them.

The wipe is an icon of its own: no data-block stays behind. Its frame is read when the artist asks for it, not while a
panel is drawn.
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
"""Of the square icon, pixels"""

_icons: bpy.utils.previews.ImagePreviewCollection | None = None
# capture folder, frame, and the frame before and after [SIDE_PX, SIDE_PX, 4], rows from below
_pair: tuple[str, str, np.ndarray, np.ndarray] | None = None


def frames(capture: Capture) -> list[str]:
    """Names of the frames that were delit."""
    return sorted(path.stem for path in capture.delit.glob("*.png"))


def show(capture: Capture, index: int, wipe: float) -> None:
    """Reads a frame before and after delighting. `index` counts the delit frames and goes round. Raises Problem where
    there is none."""
    global _pair
    frame_names = frames(capture)
    if not frame_names:
        raise Problem("No frame has been delit yet.", "Click Reconstruct: Delight is one of its stages.")
    name = frame_names[index % len(frame_names)]
    before = next((path for path in capture.frames.glob(f"{name}.*")), None)
    if before is None:
        raise Problem(f"The frame {name} is not in this capture any more.", advise_again("frames"))
    _pair = str(capture.root), name, _read(before), _read(capture.delit / f"{name}.png")
    move(wipe)


def shown_frame(capture: Capture) -> str:
    """Name of the frame that the wipe shows for this capture, '' for none."""
    return _pair[1] if _pair is not None and _pair[0] == str(capture.root) else ""


def move(wipe: float) -> None:
    """Puts the edge between before (left) and after at `wipe` of the width."""
    global _icons
    if _pair is None:
        return
    if _icons is None:
        _icons = bpy.utils.previews.new()
    picture = _icons.get("wipe") or _icons.new("wipe")
    picture.image_size = SIDE_PX, SIDE_PX
    picture.image_pixels_float.foreach_set(mixed(*_pair[2:], wipe).ravel())


def icon() -> int:
    return _icons["wipe"].icon_id


def mixed(before: np.ndarray, after: np.ndarray, wipe: float) -> np.ndarray:
    """`before` left of the edge, `after` right of it, with a white line between them; [H, W, 4]."""
    width = before.shape[1]
    edge = round(wipe * width)
    out = np.concatenate([before[:, :edge], after[:, edge:]], 1)
    if 0 < edge < width:
        out[:, edge - 1 : edge + 1, :3] = 1
    return out


def forget() -> None:
    """Drops the pictures, when the add-on leaves."""
    global _icons, _pair
    if _icons is not None:
        bpy.utils.previews.remove(_icons)
    _icons = _pair = None


def _read(path: Path) -> np.ndarray:
    """A picture fitted into a square [SIDE_PX, SIDE_PX, 4], as the eye sees it (sRGB), transparent around it."""
    image = bpy.data.images.load(str(path))
    colours.as_data(image)  # or Blender would linearise what has 16 bits, and what has 8 it would not
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
