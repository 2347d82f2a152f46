# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks of the artist as Blender images, and back to the capture's shadow_mask.png and protect_mask.png.

The only place of the add-on that flips rows: Blender counts an image's rows from the bottom, files from the top.
"""

from pathlib import Path

import bpy
import numpy as np

from ...core.capture import mask_history
from ...core.capture.capture import Capture
from ...core.capture.files import replacing
from ...core.capture.messages import Problem
from .. import colours, data_blocks
from . import png


def file_of(capture: Capture, mask_kind: str) -> Path:
    """Return the file of the mask 'SHADOW' or 'PROTECT'."""
    return capture.protect_mask if mask_kind == 'PROTECT' else capture.shadow_mask


def load(capture: Capture, mask_kind: str = 'SHADOW') -> bpy.types.Image:
    """Return the artist's mask as a Non-Color image of the texture's size, ready for painting.

    A new shadow mask starts from the proposal, a new protect mask empty.
    """
    own_file = file_of(capture, mask_kind)
    path = own_file if own_file.is_file() else capture.shadow_mask_auto
    if not path.is_file():
        raise Problem("This capture has no shadow mask yet.", "Click Reconstruct first.")
    name = f"{capture.root.stem} {mask_kind.capitalize()} Mask"
    image = bpy.data.images.get(name)
    if image is not None:
        settle(image, capture, mask_kind)
        path = own_file if own_file.is_file() else path
        bpy.data.images.remove(image)
    image = bpy.data.images.load(str(path))
    image.name = name
    colours.as_data(image)
    if not image.size[0]:  # asking for the size reads the file
        bpy.data.images.remove(image)
        raise Problem(
            f"{path} is not a picture that can be read.",
            "Restore it from mask_history, or delete it to start from the proposal.",
        )
    # The proposal is never overwritten: if Blender saves the image itself, it writes to the artist's mask.
    image.filepath_raw = str(own_file)
    if mask_kind == 'PROTECT' and not own_file.is_file():
        set_values(image, np.zeros_like(mask_values(image)))
    return image


def settle(image: bpy.types.Image, capture: Capture, mask_kind: str) -> None:
    """Compare a mask packed in the .blend with the capture's: the newer one is kept, the other goes to the history."""
    path = file_of(capture, mask_kind)
    if image.packed_file is None or not bpy.data.filepath or not image.size[0]:
        return
    packed_png = grey_png(mask_values(image))
    if path.is_file() and path.read_bytes() == packed_png:
        return
    if not path.is_file() or Path(bpy.data.filepath).stat().st_mtime > path.stat().st_mtime:
        mask_history.keep(capture, path)
        write(path, packed_png)
    else:
        mask_history.keep(capture, path, packed_png)


def refresh(image: bpy.types.Image, capture: Capture, mask_kind: str) -> None:
    """Load the newer mask of a reopened .blend and the capture into the image. Raises Problem if there is none."""
    path = file_of(capture, mask_kind)
    settle(image, capture, mask_kind)
    if image.packed_file is not None:
        image.unpack(method='REMOVE')
    image.filepath_raw = str(path)
    if path.is_file():
        image.reload()
    elif capture.shadow_mask_auto.is_file():
        image.source = 'FILE'
        is_shadow = mask_kind == 'SHADOW'
        set_values(image, proposal(image, capture.shadow_mask_auto) if is_shadow else np.zeros_like(mask_values(image)))
    colours.as_data(image)
    if not image.size[0]:
        raise Problem(
            "The mask that was being painted is missing.", "Click Paint on the Head, under Masks, to load it again."
        )


def mask_values(image: bpy.types.Image) -> np.ndarray:
    """Return the mask float32 [H, W] in [0, 1], rows from the top."""
    return from_top(data_blocks.read_pixels(image))


def from_top(pixels: np.ndarray) -> np.ndarray:
    """Return the mask [H, W], rows from the top, of an image's pixels. Safe in a thread."""
    return np.flipud(pixels[..., 0])


def set_values(image: bpy.types.Image, mask: np.ndarray) -> None:
    """Put a mask [H, W] in [0, 1], rows from the top, into the image."""
    width, height = image.size
    pixels = np.ones((height, width, image.channels), np.float32)
    pixels[..., : min(3, image.channels)] = np.flipud(mask)[..., None]
    image.pixels.foreach_set(pixels.ravel())
    image.update()


def proposal(image: bpy.types.Image, path: Path) -> np.ndarray:
    """Return the mask of a file [H, W] at the image's size. Raises Problem if there is none."""
    if not path.is_file():
        raise Problem(
            "This capture has no proposal for its shadow mask.", "Click Reconstruct, or paint the mask by hand."
        )
    other = bpy.data.images.load(str(path))
    try:
        colours.as_data(other)
        if tuple(other.size) != tuple(image.size):
            other.scale(*image.size)
        return mask_values(other).copy()
    finally:
        bpy.data.images.remove(other)


def store_mask(mask: np.ndarray, capture: Capture, mask_kind: str, keep: bool = True) -> bool:
    """Write a mask [H, W] in [0, 1], rows from the top, as 8 bit grey, atomically. Safe in a thread.

    With `keep` the previous mask goes to mask_history. False means that nothing was written: the file is the same, or
    nothing is protected and never was.
    """
    path = file_of(capture, mask_kind)
    content = grey_png(mask)
    if path.read_bytes() == content if path.is_file() else mask_kind == 'PROTECT' and not mask.any():
        return False
    if keep:
        mask_history.keep(capture, path)
    write(path, content)
    return True


def write(path: Path, content: bytes) -> None:
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def grey_png(mask: np.ndarray) -> bytes:
    """Return an 8 bit grey PNG of a mask [H, W] in [0, 1], rows from the top."""
    return png.encode(np.clip(np.round(mask * 255), 0, 255).astype(np.uint8)[..., None])
