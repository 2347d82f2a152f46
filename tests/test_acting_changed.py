# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head with face units of which the artist cut something away since, as one does before joining it to a body: what is
left of it stays as it is."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
bmesh = pytest.importorskip("bmesh")

from tests.test_acting import coordinates, head, write_head  # noqa: E402, F401  (head is a fixture)

NECK_M = -0.12
"""Height below which the built-in head is neck."""


def cut_neck(head) -> None:  # noqa: F811
    bpy.ops.object.mode_set(mode='EDIT')
    mesh = bmesh.from_edit_mesh(head.data)
    bmesh.ops.delete(mesh, geom=[vertex for vertex in mesh.verts if vertex.co.z < NECK_M], context='VERTS')
    bmesh.update_edit_mesh(head.data)
    bpy.ops.object.mode_set(mode='OBJECT')


def places(head) -> dict[str, np.ndarray]:  # noqa: F811
    """Of the mesh and of each of its shape keys."""
    return {"": coordinates(head.data.vertices),
            **{key.name: coordinates(key.data) for key in head.data.shape_keys.key_blocks}}


@pytest.mark.parametrize("own_key", [False, True])
def test_a_head_whose_neck_was_cut_keeps_every_vertex_and_key_when_another_shape_comes(head, capture, own_key):  # noqa: F811
    if own_key:
        head.shape_key_add(name="Mine", from_mix=False).data[7].co.x += 0.01
    cut_neck(head)
    before, mesh, meshes = places(head), head.data, len(bpy.data.meshes)
    write_head(capture, 0.85)
    with pytest.raises(RuntimeError, match="changed since it got its face units"):
        bpy.ops.wildcap.bring_in_head()
    assert head.data == mesh and len(bpy.data.meshes) == meshes
    after = places(head)
    assert before.keys() == after.keys() and len(before) > 50
    assert all(np.array_equal(before[name], after[name]) for name in before)
