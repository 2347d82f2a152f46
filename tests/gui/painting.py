# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What flows that paint a mask share: a dab of the brush, the mask in Blender and on the disk, and which texel lies
under the cursor.

Masks are [H, W] in [0, 1], rows from the top. Data-blocks are looked up anew each time: an undo replaces them.
"""

import bpy
import driver as d
import numpy as np
from bpy_extras import view3d_utils
from mathutils import Vector
from mathutils.geometry import barycentric_transform


def in_hand():
    yield from d.until(lambda: bpy.context.mode == 'PAINT_TEXTURE', "texture painting", 10)
    yield 0.5


def dab(x: float, y: float, ctrl: bool = False):
    """A short stroke to both sides of a window position; with Ctrl it takes away."""
    yield from d.stroke([(x - 12 + 3 * i, y) for i in range(9)], ctrl=ctrl)


def visible_dab(x: float, y: float):
    """A dab that changes the mask whatever it is, and the proof that it did: red into the empty, else it takes away."""
    before = mask()
    yield from dab(x, y)
    if np.abs(mask() - before).max() < 0.4:
        yield from dab(x, y, ctrl=True)
    assert np.abs(mask() - before).max() > 0.4, "the stroke changed nothing"


def mask() -> np.ndarray:
    """The mask that is being painted."""
    return pixels(bpy.context.scene.tool_settings.image_paint.stencil_image)


def on_disk(path) -> np.ndarray:
    """The mask of a file."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = 'Non-Color'
    found = pixels(image)
    bpy.data.images.remove(image)
    return found


def pixels(image) -> np.ndarray:
    """An image's first channel."""
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return np.flipud(values.reshape(image.size[1], image.size[0], -1)[..., 0]).copy()


def kept(path, wanted: np.ndarray, limit_s: float = 5):
    """Waits until the file holds that mask."""
    yield from d.until(
        lambda: path.is_file() and np.abs(on_disk(path) - wanted).max() < 0.01, f"the mask in {path.name}", limit_s
    )


def facing(obj, towards: Vector) -> tuple[float, float]:
    """Window pixels of where a ray from outside along -`towards` meets the object."""
    centre = sum((Vector(c) for c in obj.bound_box), Vector()) / 8
    start = centre + towards.normalized()
    hit, point, _, _ = obj.ray_cast(start, (centre - start).normalized())
    assert hit
    return on_screen(obj.matrix_world @ point)


def on_screen(point: Vector) -> tuple[float, float]:
    """Window pixels of a world point."""
    region = d.region()
    x, y = view3d_utils.location_3d_to_region_2d(region, d.view().spaces.active.region_3d, point)
    return region.x + x, region.y + y


def uv_under(head, position) -> tuple[float, float]:
    """(u, v) of the head under a window position: a ray to it, and the UV where it hits."""
    region, region_3d = d.region(), d.view().spaces.active.region_3d
    inside = position[0] - region.x, position[1] - region.y
    origin = view3d_utils.region_2d_to_origin_3d(region, region_3d, inside)
    direction = view3d_utils.region_2d_to_vector_3d(region, region_3d, inside)
    to_local = head.matrix_world.inverted()
    hit, point, _, face = head.ray_cast(to_local @ origin, to_local.to_3x3() @ direction)
    assert hit, "the head is under the cursor"
    mesh = head.data
    mesh.calc_loop_triangles()
    for triangle in mesh.loop_triangles:
        if triangle.polygon_index == face:
            corners = [mesh.vertices[v].co for v in triangle.vertices]
            uvs = [Vector((*mesh.uv_layers[0].data[loop].uv, 0)) for loop in triangle.loops]
            uv = barycentric_transform(point, *corners, *uvs)
            if -0.01 <= min(uv.x, uv.y):
                break
    return uv.x, uv.y


def texel(uv: tuple[float, float], size: int) -> tuple[int, int]:
    """(row, column) of a square map."""
    return int((1 - uv[1]) * size), int(uv[0] * size)
