# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's data-blocks: numbers as arrays, replaced object data, removed animation."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np


def read_field(collection, field: str, width: int = 1, kind=np.float32) -> np.ndarray:
    """Return a field of a collection's N members: [N], or [N, width] if a member has several numbers."""
    values = np.empty((len(collection), width) if width > 1 else len(collection), kind)
    collection.foreach_get(field, values.ravel())
    return values


def read_pixels(image: bpy.types.Image) -> np.ndarray:
    """Return an image's pixels, float32 [H, W, C], the lowest row first."""
    width, height = image.size
    pixels = np.empty((height, width, image.channels), np.float32)
    image.pixels.foreach_get(pixels.ravel())
    return pixels


def load_pixels(path: Path) -> np.ndarray:
    """Return a file's pixels as they are stored there."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.is_data = True
    pixels = read_pixels(image)
    bpy.data.images.remove(image)
    return pixels


def find(blocks, name: str) -> bpy.types.ID | None:
    """Return this file's own data-block of that name: changes of a linked one would be lost when the file reopens."""
    return blocks.get((name, None))


def replace_data(obj: bpy.types.Object, data, kind) -> None:
    """Give an object other data of its `kind` (bpy.data.meshes and the like).

    Materials are kept; so is the name if nothing else uses the old data.
    """
    old, obj.data = obj.data, data
    for material in old.materials:
        data.materials.append(material)
    name = old.name
    if old.users == 0:
        kind.remove(old)
        data.name = name


def scale_of(obj: bpy.types.Object) -> float:
    """Return an object's scale as the mean of its axes."""
    return sum(map(abs, obj.matrix_world.to_scale())) / 3  # negative for a mirrored object


def stop_animation(data_block: bpy.types.ID) -> None:
    """Remove a data-block's animation, and its action if nothing else uses it."""
    action = data_block.animation_data.action if data_block.animation_data else None
    data_block.animation_data_clear()
    if action is not None and action.users == 0:
        bpy.data.actions.remove(action)
