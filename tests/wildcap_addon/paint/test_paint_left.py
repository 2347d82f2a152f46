# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head that is excluded from the view layer, renamed or deleted while its mask is painted: the painting ends with the
mask saved and the head as it was."""

import numpy as np
import pytest

from tests.fixtures.refused import refuses

bpy = pytest.importorskip("bpy")


@pytest.fixture
def exclude(head):
    """Function that takes the collection of the head out of the view layer, or puts it back."""
    faces = bpy.data.collections.new("Faces")
    bpy.context.scene.collection.children.link(faces)
    faces.objects.link(head)
    bpy.context.scene.collection.objects.unlink(head)
    bpy.context.view_layer.objects.active = head

    def exclude(out: bool) -> None:
        bpy.context.view_layer.layer_collection.children["Faces"].exclude = out
        bpy.context.view_layer.update()

    return exclude


def test_a_head_whose_collection_is_excluded_is_told_to_be_shown(exclude):
    exclude(True)
    meshes = len(bpy.data.meshes)
    for button in (bpy.ops.wildcap.bring_in_head, bpy.ops.wildcap.paint_mask):
        refuses("excluded from this view layer", button)
    assert len(bpy.data.meshes) == meshes and bpy.context.mode == 'OBJECT'


def test_a_head_that_is_excluded_while_it_is_painted_ends_the_painting_with_its_mask_saved(exclude, session, capture):
    bpy.ops.wildcap.paint_mask()
    image = session.mask()
    image.pixels.foreach_set(np.ones(len(image.pixels), np.float32))
    exclude(True)
    session.end_painting(bpy.context)
    assert not session.active() and (capture / "shadow_mask.png").is_file()
    exclude(False)
    assert bpy.ops.wildcap.paint_mask() == bpy.ops.wildcap.finish_mask() == {'FINISHED'}


def test_a_painting_whose_head_was_deleted_still_ends_and_keeps_its_mask(session, capture, head, paint_spot):
    bpy.ops.wildcap.paint_mask()
    painted = paint_spot(10)
    bpy.ops.object.mode_set(mode='OBJECT')
    bpy.data.objects.remove(head)
    bpy.ops.wildcap.finish_mask()
    assert not session.active() and (capture / "shadow_mask.png").read_bytes() == painted
    assert "WildCap Mask" not in bpy.data.brushes and not bpy.context.scene.tool_settings.image_paint.use_stencil_layer


def test_the_watch_goes_on_whatever_ending_raises(addon, session, capture, head, monkeypatch):
    if not bpy.context.window_manager.windows:
        pytest.skip("no window in this Blender: the flows in a window hold it")

    def fail(context):
        raise RuntimeError("not in the view layer")

    bpy.ops.wildcap.paint_mask()
    bpy.ops.object.mode_set(mode='OBJECT')
    with monkeypatch.context() as patched:
        patched.setattr(session, "end_painting", fail)
        assert session._watch() == 4 * session.WATCH_S
    assert "not in the view layer" in addon("problems").of(str(capture)).problem
    session._watch()
    assert not session.active()


def test_a_head_that_was_renamed_while_it_was_painted_is_let_go_as_it_was(head):
    for name in ("Basis", "Smile"):
        head.shape_key_add(name=name)
    head.active_shape_key_index, head.data.use_mirror_x = 1, True
    bpy.ops.wildcap.paint_mask()
    assert head.show_only_shape_key
    head.name = "Hero"
    assert bpy.ops.wildcap.paint_mask(on='SHEET') == bpy.ops.wildcap.finish_mask() == {'FINISHED'}
    assert not head.show_only_shape_key and head.active_shape_key_index == 1 and head.data.use_mirror_x
    assert bpy.context.view_layer.objects.active == head and bpy.context.selected_objects == [head]
    assert bpy.context.mode == 'OBJECT'
