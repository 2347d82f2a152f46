# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The running solve's albedo on the head itself: an image node in its material, made by the click on Solve, that the
timer reads anew.

Solid shading shows a material's active image node, so nothing is linked and the artist's own nodes stay. While somebody
paints or edits, nothing is touched.
"""

from pathlib import Path

import bpy

from ...core.capture.capture import Capture
from .. import captures, head, jobs

_ended: set[str] = set()  # captures whose solve has ended while somebody painted


def waits(root: str) -> bool:
    """Whether a capture's heads still show a solve that has ended."""
    return root in _ended


def take(_context, item) -> None:
    """What waited for the end of a painting; called in Object Mode."""
    if captures.root(item) in _ended:
        update(captures.root(item))


def forget() -> None:
    _ended.clear()


def prepare(context, item) -> None:
    """Puts the node into the head's material, for `update` to show once there is a picture. Without a head or a
    material there is nothing to show it on."""
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
    """Shows the newest picture of the capture's solve on its heads, and what they showed before once it has ended, or
    once nobody paints any more. Makes no data-blocks."""
    ended = jobs.of(root) is None
    _ended.discard(root)
    if ended and bpy.context.mode == 'PAINT_TEXTURE':
        _ended.add(root)  # the active node may be what is painted on
    if root in _ended or not ended and bpy.context.mode != 'OBJECT':
        return
    for nodes, node in _nodes(root):
        if ended:
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
    for material in bpy.data.materials:
        node = material.node_tree.nodes.get(head.PREVIEW) if material.node_tree is not None else None
        if (
            node is not None
            and node.image is not None
            and str(Path(bpy.path.abspath(node.image.filepath)).parent) == preview
        ):
            yield material.node_tree.nodes, node
