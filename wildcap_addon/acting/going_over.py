# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Carry an artist's attributes, UV maps, seams and vertex groups over to a mesh that has the same elements and more."""

import numpy as np

from ..data_blocks import read_field

LAYOUT = {
    'FLOAT': ("value", 1, np.float32),
    'INT': ("value", 1, np.int32),
    'INT8': ("value", 1, np.int32),
    'BOOLEAN': ("value", 1, bool),
    'FLOAT2': ("vector", 2, np.float32),
    'FLOAT_VECTOR': ("vector", 3, np.float32),
    'FLOAT_COLOR': ("color", 4, np.float32),
    'BYTE_COLOR': ("color", 4, np.float32),
}
"""Attribute types that are carried over: field, its width, and its type."""
SEAM = ".uv_seam"
"""Seams in Blender 4.2, which treats the attribute as internal."""

Weights = list[tuple[str, bool, dict[float, list[int]]]]


def copy_attributes(old, new, origins: dict[str, np.ndarray]) -> None:
    """Copy the attributes that the new mesh lacks, UV maps included.

    origins: domain -> for each element of the new mesh the old one that it comes from, -1 for none, which gets zeros.
    """
    for attribute in old.attributes:
        is_own = attribute.name == SEAM or not attribute.is_internal
        if is_own and attribute.data_type in LAYOUT and attribute.name not in new.attributes:
            field, width, kind = LAYOUT[attribute.data_type]
            origin = origins[attribute.domain]
            values = read_field(attribute.data, field, width, kind)[origin]
            values[origin < 0] = 0
            copy = new.attributes.new(attribute.name, attribute.data_type, attribute.domain)
            copy.data.foreach_set(field, values.ravel())
    for name in ("active_color_name", "default_color_name"):
        setattr(new.attributes, name, getattr(old.attributes, name))
    new.uv_layers.active_index = old.uv_layers.active_index
    for layer in new.uv_layers:
        layer.active_render = old.uv_layers[layer.name].active_render


def read_weights(obj) -> Weights:
    """Return each vertex group of an object: its name, whether it is locked, and the vertices with each weight."""
    groups = [(group.name, group.lock_weight, {}) for group in obj.vertex_groups]
    for vertex in obj.data.vertices:
        for part in vertex.groups:
            groups[part.group][2].setdefault(part.weight, []).append(vertex.index)
    return groups


def write_weights(obj, groups: Weights, origin: np.ndarray) -> None:
    """Make such groups on an object; origin: the old vertex of each new one, -1 for one without a group."""
    copies: dict[int, list[int]] = {}
    for row, source in enumerate(origin.tolist()):
        copies.setdefault(source, []).append(row)
    for name, locked, weights in groups:
        group = obj.vertex_groups.new(name=name)
        for weight, rows in weights.items():
            group.add([copy for row in rows for copy in copies[row]], weight, 'REPLACE')
        group.lock_weight = locked
