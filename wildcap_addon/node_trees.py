# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The shader nodes of materials and worlds: from Blender 5.0 on each has them from the start, and switching them on is
deprecated."""

import bpy


def of(block: bpy.types.Material | bpy.types.World) -> bpy.types.NodeTree:
    """The nodes by which a material or a world is shown."""
    if bpy.app.version < (5, 0, 0):
        block.use_nodes = True
    return block.node_tree
