# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Albedo of the running solve on the head: an image node in its material, made by Solve and reloaded by the timer.

Solid shading shows a material's active image node, so no links are needed and the artist's own nodes are kept. Nothing
changes while somebody paints or edits.
"""

from pathlib import Path

import bpy

from ...core.capture.capture import Capture
from .. import captures, head, jobs

_ended: set[str] = set()  # captures whose solve ended during painting


def waits(root: str) -> bool:
    """Return whether a capture's heads still show a solve that has ended."""
    return root in _ended


def take(_context, item) -> None:
    """Finish what waited for the end of painting; called in Object Mode."""
    if captures.root(item) in _ended:
        update(captures.root(item))


def forget() -> None:
    _ended.clear()


def prepare(context, item) -> None:
    """Put the node into the material of the head, if there is one, for `update` to show."""
    obj = captures.head(context, item)
    material = obj.data.materials[0] if obj is not None and obj.data.materials else None  # others are eyes and mouth
    if material is None or material.node_tree is None:
        return
    nodes = material.node_tree.nodes
    node = nodes.get(head.PREVIEW)
    if node is None:
        node = nodes.new('ShaderNodeTexImage')
        node.name = node.label = head.PREVIEW
        node.location = (-320, -320)
        node.image = bpy.data.images.new(f"{obj.name} {head.PREVIEW}", 8, 8)
    path = captures.folder(item).preview / "albedo.png"
    path.unlink(missing_ok=True)  # of another solve
    node.image.source = 'FILE'
    node.image.filepath = str(path)
    if nodes.active is not None and nodes.active != node:
        node["before"] = nodes.active.name


def update(root: str) -> None:
    """Show the newest picture of the solve on the capture's heads; after its end, and after painting, what was before.

    Makes no data-blocks.
    """
    has_ended = jobs.of(root) is None
    _ended.discard(root)
    if has_ended and bpy.context.mode == 'PAINT_TEXTURE':
        _ended.add(root)  # the active node may be the canvas
    if root in _ended or not has_ended and bpy.context.mode != 'OBJECT':
        return
    for nodes, node in _nodes(root):
        if has_ended:
            nodes.active = nodes.get(node.get("before", "")) or nodes.active
        elif Path(bpy.path.abspath(node.image.filepath)).is_file():
            node.image.reload()
            nodes.active = node
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == 'VIEW_3D':
                area.tag_redraw()


def _nodes(root: str):
    preview = str(Capture(root).preview)
    for tree in (material.node_tree for material in bpy.data.materials if material.node_tree is not None):
        node = tree.nodes.get(head.PREVIEW)
        if node is not None and node.image is not None:
            if str(Path(bpy.path.abspath(node.image.filepath)).parent) == preview:
                yield tree.nodes, node
