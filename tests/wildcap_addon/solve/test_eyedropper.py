# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The skin tone picked from the head: a ray finds the UV it meets, and the colour there is the texture's, in whatever
kind of image it is."""

import numpy as np
import pytest

from tests.fixtures import standin
from tests.fixtures.refused import refuses

bpy = pytest.importorskip("bpy")
U, V = standin.LEFT_CHEEK_UV


def marked(name: str, is_float: bool, side: int = 256):
    """Grey, with a cheek of another colour around the left cheek's UV."""
    image = bpy.data.images.new(name, side, side, float_buffer=is_float)
    pixels = np.full((side, side, 4), 0.5, np.float32)
    row, column = int(V * side), int(U * side)
    pixels[row - 20 : row + 20, column - 20 : column + 20, :3] = (0.8, 0.4, 0.2)
    image.pixels.foreach_set(pixels.ravel())
    return image


@pytest.mark.parametrize("turned", [0.0, 0.7])
def test_a_ray_finds_the_uv_of_what_it_meets_wherever_the_head_stands(addon, head, turned):
    """The egg is convex: a ray against a triangle's normal meets its middle, where the UV is the mean of its
    corners'."""
    from mathutils import Matrix, Vector

    mesh, uv_on = head.data, addon("solve.eyedropper").uv_on
    head.matrix_world = Matrix.Translation((1, 2, 3)) @ Matrix.Rotation(turned, 4, 'Z') @ Matrix.Scale(2, 4)
    bpy.context.view_layer.update()
    mesh.calc_loop_triangles()
    for triangle in list(mesh.loop_triangles)[200::97]:
        middle = head.matrix_world @ (sum((mesh.vertices[v].co for v in triangle.vertices), Vector()) / 3)
        normal = (head.matrix_world.to_3x3() @ triangle.normal).normalized()
        expected = np.mean([mesh.uv_layers[0].data[loop].uv for loop in triangle.loops], axis=0)
        assert uv_on(head, middle + normal, -normal) == pytest.approx(tuple(expected), abs=1e-3)
        assert uv_on(head, middle + normal, normal) is None


@pytest.mark.parametrize("is_float", [False, True])
def test_the_colour_is_the_textures_as_the_eye_sees_it(addon, head, is_float):
    """Bytes hold sRGB; a 16-bit or EXR picture holds linear light in Blender, which is turned into sRGB."""
    head.active_material.node_tree.nodes["Texture"].image = marked("cheek", is_float)
    item = bpy.context.scene.wildcap.captures[0]
    assert not item.use_skin_tone
    bpy.ops.wildcap.pick_skin_tone(uv=(U, V))
    linear = np.array([0.8, 0.4, 0.2])
    expected = 1.055 * linear ** (1 / 2.4) - 0.055 if is_float else linear
    assert np.abs(np.array(item.skin_tone) - expected).max() < 0.01 and item.use_skin_tone


def test_without_a_texture_there_is_nothing_to_pick(head):
    head.data.materials.clear()
    refuses("shows no texture", bpy.ops.wildcap.pick_skin_tone, uv=(U, V))
