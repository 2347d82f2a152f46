# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Walk through a batch's masks: the next face comes into the scene, the previous one is put aside."""

from pathlib import Path

import bpy

from ...core.batch.record import BatchFace
from .. import batches, captures, head, local_view, problems, properties


def painting() -> bool:
    return bpy.ops.wildcap.finish_mask.poll()


def following(root: str) -> BatchFace | None:
    """Return the face whose mask waits next after the capture `root`, wrapping around; None if no other waits."""
    waiting, known = batches.waiting(), batches.view()
    others = [face for face in waiting if str(face.root) != root]
    order = [str(face.root) for face in known.batch.faces] if known.batch else []
    here = order.index(root) if root in order else -1
    return next((face for face in others if order.index(str(face.root)) > here), others[0] if others else None)


def leave(root: str) -> None:
    """Save the mask that is being painted, and end the painting. Raises Problem if it cannot."""
    if painting():
        _click(bpy.ops.wildcap.finish_mask, root)


def go(context, face: BatchFace) -> None:
    """Bring a face in, alone, and begin to paint its mask. Raises the Problem of the operators involved."""
    before = captures.active(context)
    leave(captures.root(before))
    if before is not None and captures.root(before) != str(face.root):
        _put_aside(context, before)
    item = list_face(context, face)
    _click(bpy.ops.wildcap.bring_in_head, str(face.root))
    obj = captures.require_head(context, item)
    captures.show_again(obj)
    local_view.join(context, [obj])
    head.look_at(context, obj)
    _click(bpy.ops.wildcap.paint_mask, str(face.root))


def list_face(context, face: BatchFace):
    """Return the face's item of the scene's list, now the active one; a new item gets the batch's settings."""
    known = {captures.root(item) for item in context.scene.wildcap.captures}
    item = captures.add(context, face.root)
    if str(face.root) not in known:
        item.name = face.name
        properties.take(item, face.quality, face.chosen())
    return item


def _put_aside(context, item) -> None:
    """Hide a face's head until its row is clicked, and free its pictures: memory does not hold hundreds of faces."""
    obj = captures.head(context, item)
    if obj is None or obj.name not in context.view_layer.objects:
        return
    captures.put_aside(obj)
    folder = captures.folder(item).root
    for image in bpy.data.images:
        stored = image.source == 'FILE' and not image.is_dirty and not image.packed_file
        if stored and Path(bpy.path.abspath(image.filepath)).is_relative_to(folder):
            image.buffers_free()


def _click(operator, root: str) -> None:
    """Run another room's operator. Raises its Problem."""
    problems.clear(root)
    try:
        operator()
    except RuntimeError as error:
        raise problems.of(root) or error from None
