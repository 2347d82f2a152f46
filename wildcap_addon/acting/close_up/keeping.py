# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Detect by a digest of its mesh whether somebody modelled on an object of the close-up since it was made."""

import hashlib

import numpy as np

from ...data_blocks import read_field

MADE = "wildcap_made"
"""Custom property of such an object: its digest as it was made."""
BLENDERS_OWN = ("material_index", "sharp_face", "sharp_edge", "custom_normal")
"""Attributes that Blender adds and removes by itself."""


def note(thing) -> None:
    """Record an object as made."""
    thing[MADE] = _digest(thing)


def is_modelled(thing) -> bool:
    return thing.get(MADE) != _digest(thing)


def _digest(thing) -> str:
    """Hash its location, vertices, faces, UVs and shape keys, and the names of its groups and attributes."""
    mesh = thing.data
    keys = mesh.shape_keys.key_blocks if mesh.shape_keys else ()
    attributes = {attribute.name for attribute in mesh.attributes if not attribute.is_internal} - {*BLENDERS_OWN}
    names = [key.name for key in keys], [group.name for group in thing.vertex_groups], sorted(attributes)
    arrays = [
        np.array(thing.location, np.float32),
        read_field(mesh.vertices, "co", 3),
        read_field(mesh.loops, "vertex_index", kind=np.int32),
        *(read_field(layer.data, "uv", 2) for layer in mesh.uv_layers),
        *(read_field(key.data, "co", 3) for key in keys),
    ]
    content = repr(names).encode() + b"".join(array.tobytes() for array in arrays)
    return hashlib.blake2b(content, digest_size=16).hexdigest()
