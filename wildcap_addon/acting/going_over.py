# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist made on a mesh goes over to another one that has its elements and more: attributes, UV maps, seams and
vertex groups."""

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
"""Kinds of attributes that are carried over: field, how many numbers it has, and of which kind."""
SEAM = ".uv_seam"
"""Seams in Blender 4.2, which counts the attribute as its own."""
ACTIVE = ("active_color_name", "default_color_name")


def copy_attributes(old, new, origins: dict[str, np.ndarray]) -> None:
    """All that the new mesh has not got, UV maps among them. origins: domain -> of each of the new mesh's elements the
    old one that it comes from, -1 for none: it gets zeros."""
    for attribute in old.attributes:
        theirs = attribute.name == SEAM or not attribute.is_internal
        if theirs and attribute.data_type in LAYOUT and attribute.name not in new.attributes:
            field, width, kind = LAYOUT[attribute.data_type]
            values, origin = read_field(attribute.data, field, width, kind), origins[attribute.domain]
            every = values[origin]
            every[origin < 0] = 0
            made = new.attributes.new(attribute.name, attribute.data_type, attribute.domain)
            made.data.foreach_set(field, every.ravel())
    for name in ACTIVE:
        setattr(new.attributes, name, getattr(old.attributes, name))
    new.uv_layers.active_index = old.uv_layers.active_index
    for layer in new.uv_layers:
        layer.active_render = old.uv_layers[layer.name].active_render


def read_weights(obj) -> list[tuple[str, bool, dict[float, list[int]]]]:
    """Each vertex group of an object: its name, whether it is locked, and which vertices have each weight."""
    groups = [(group.name, group.lock_weight, {}) for group in obj.vertex_groups]
    for vertex in obj.data.vertices:
        for part in vertex.groups:
            groups[part.group][2].setdefault(part.weight, []).append(vertex.index)
    return groups


def write_weights(obj, groups: list[tuple[str, bool, dict[float, list[int]]]], origin: np.ndarray) -> None:
    """Makes such groups on an object. origin: of each of its vertices the one that it comes from, -1 for none: it is in
    no group."""
    ours: dict[int, list[int]] = {}
    for row, known in enumerate(origin.tolist()):
        ours.setdefault(known, []).append(row)
    for name, locked, weights in groups:
        group = obj.vertex_groups.new(name=name)
        for weight, rows in weights.items():
            group.add([own for row in rows for own in ours[row]], weight, 'REPLACE')
        group.lock_weight = locked
