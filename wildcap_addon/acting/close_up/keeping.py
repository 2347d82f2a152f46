# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether somebody modelled on an object of the close-up since it was made: a digest of its mesh tells."""

import hashlib

import numpy as np

from ...data_blocks import read_field

MADE = "wildcap_made"
"""Custom property of such an object: the digest of it as it was made."""
BLENDERS_OWN = ("material_index", "sharp_face", "sharp_edge", "custom_normal")
"""Attributes that come and go by themselves."""


def note(thing) -> None:
    """To be called once it is made."""
    thing[MADE] = _digest(thing)


def is_modelled(thing) -> bool:
    return thing.get(MADE) != _digest(thing)


def _digest(thing) -> str:
    """Stands for where it lies, its vertices, faces, UVs and shape keys, and the names of its groups and
    attributes."""
    mesh = thing.data
    keys = mesh.shape_keys.key_blocks if mesh.shape_keys else ()
    names = (
        [key.name for key in keys],
        [group.name for group in thing.vertex_groups],
        sorted(
            attribute.name
            for attribute in mesh.attributes
            if not attribute.is_internal and attribute.name not in BLENDERS_OWN
        ),
    )
    arrays = [
        np.array(thing.location, np.float32),
        read_field(mesh.vertices, "co", 3),
        read_field(mesh.loops, "vertex_index", kind=np.int32),
        *(read_field(layer.data, "uv", 2) for layer in mesh.uv_layers),
        *(read_field(key.data, "co", 3) for key in keys),
    ]
    told = repr(names).encode() + b"".join(array.tobytes() for array in arrays)
    return hashlib.blake2b(told, digest_size=16).hexdigest()
