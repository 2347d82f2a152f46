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


def read_pixels(image: bpy.types.Image, into: np.ndarray | None = None) -> np.ndarray:
    """Return an image's pixels, float32 [H, W, C], the lowest row first; in `into` if that has the shape."""
    shape = image.size[1], image.size[0], image.channels
    pixels = into if into is not None and into.shape == shape else np.empty(shape, np.float32)
    image.pixels.foreach_get(pixels.ravel())
    return pixels


def load_pixels(path: Path) -> np.ndarray:
    """Return a file's pixels as they are stored there, alpha beside the colours."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.is_data = True
    image.alpha_mode = 'CHANNEL_PACKED'  # or Blender multiplies the colours of 16 bits by it
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


def new_child(obj: bpy.types.Object, name: str, data=None) -> bpy.types.Object:
    """Return a new child of an object, in the same collections."""
    child = bpy.data.objects.new(name, data)
    for collection in obj.users_collection:
        collection.objects.link(child)
    child.parent = obj
    return child


def add_driver(block, field: str, expression: str, index: int = -1) -> bpy.types.Driver:
    """Drive a field by a simple expression, which needs no Python; its variables are still to be added."""
    driver = block.driver_add(field, index).driver
    driver.type = 'SCRIPTED'
    driver.expression = expression
    return driver


def add_variable(driver: bpy.types.Driver, keys: bpy.types.Key, path: str, name: str = "") -> None:
    """Add a driver's variable that reads a property of shape keys."""
    variable = driver.variables.new()
    variable.name = name or variable.name
    variable.targets[0].id_type, variable.targets[0].id = 'KEY', keys
    variable.targets[0].data_path = path


def value_path(key: str) -> str:
    """Return the path of a shape key's value, by its name."""
    return f'key_blocks["{key}"].value'
