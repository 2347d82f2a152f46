# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's data-blocks: their numbers as arrays, an object's data replaced by other data, animation taken away."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np


def read_field(collection, field: str, width: int = 1, kind=np.float32) -> np.ndarray:
    """A field of all N members of a collection.

    Parameters
    ----------
    collection : of Blender's properties
    field : its name
    width : how many numbers a member has
    kind : their type, the field's own

    Returns
    -------
    [N], or [N, width] where that is more than 1.
    """
    values = np.empty((len(collection), width) if width > 1 else len(collection), kind)
    collection.foreach_get(field, values.ravel())
    return values


def read_pixels(image: bpy.types.Image) -> np.ndarray:
    """float32 [H, W, C], the lowest row first."""
    width, height = image.size
    pixels = np.empty((height, width, image.channels), np.float32)
    image.pixels.foreach_get(pixels.ravel())
    return pixels


def load_pixels(path: Path) -> np.ndarray:
    """Those of a file as they are stored there."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.is_data = True
    pixels = read_pixels(image)
    bpy.data.images.remove(image)
    return pixels


def find(blocks, name: str) -> bpy.types.ID | None:
    """Of this file's own data-blocks of a kind (bpy.data.node_groups and the like) the one of that name: what is linked
    from a library would lose at the next opening whatever is written into it."""
    return blocks.get((name, None))


def replace_data(obj: bpy.types.Object, data, kind) -> None:
    """Gives an object other data of its `kind` (bpy.data.meshes and the like), with the materials and, where nothing
    else uses the old one, the name of what it had."""
    old, obj.data = obj.data, data
    for material in old.materials:
        data.materials.append(material)
    name = old.name
    if old.users == 0:
        kind.remove(old)
        data.name = name


def scale_of(obj: bpy.types.Object) -> float:
    """How large an object is against its own units, in the mean of its axes."""
    return sum(map(abs, obj.matrix_world.to_scale())) / 3  # negative for one that is mirrored


def stop_animation(data_block: bpy.types.ID) -> None:
    """Takes a data-block's animation away, and its action, where nothing else has it."""
    action = data_block.animation_data.action if data_block.animation_data else None
    data_block.animation_data_clear()
    if action is not None and action.users == 0:
        bpy.data.actions.remove(action)
