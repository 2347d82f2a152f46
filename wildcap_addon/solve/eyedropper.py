# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator: the skin tone from a click on the head. It reads the texture that is shown there, not the screen, on which
Blender's own eyedropper finds it shaded."""

import bpy
import numpy as np
from bpy_extras import view3d_utils
from mathutils import Vector
from mathutils.geometry import barycentric_transform

from ...core.capture.messages import Problem
from .. import captures, colours
from ..base_operator import BaseOperator
from ..data_blocks import read_pixels

PATCH_SIDE_SHARE = 1 / 128
"""Half the side of the square that is averaged, in UV: pores and freckles do not decide."""


class WILDCAP_OT_pick_skin_tone(BaseOperator, bpy.types.Operator):
    """Click on evenly lit skin of the head: the mean colour of its texture around there becomes the skin tone. Esc
    leaves it"""

    bl_idname = "wildcap.pick_skin_tone"
    bl_label = "Pick Skin Tone"
    bl_options = {'REGISTER', 'UNDO'}

    uv: bpy.props.FloatVectorProperty(
        name="UV", size=2, description="Where on the texture to look; a click in the 3D view says it"
    )

    @classmethod
    def poll(cls, context):
        item = captures.active(context)
        return cls.with_capture(context) and cls.allowed(
            captures.head(context, item) is not None, "The head is not in this scene: click Bring In Head"
        )

    def invoke(self, context, event):
        context.window.cursor_modal_set('EYEDROPPER')
        context.window_manager.modal_handler_add(self)
        return {'RUNNING_MODAL'}

    def modal(self, context, event):
        if event.type in ('ESC', 'RIGHTMOUSE'):
            context.window.cursor_modal_restore()
            return {'CANCELLED'}
        if event.type != 'LEFTMOUSE' or event.value != 'PRESS':
            return {
                'PASS_THROUGH' if event.type in ('MIDDLEMOUSE', 'WHEELUPMOUSE', 'WHEELDOWNMOUSE') else 'RUNNING_MODAL'
            }
        context.window.cursor_modal_restore()
        uv = uv_under(context.window, event, captures.require_head(context, captures.require(context)))
        if uv is None:
            self.report({'WARNING'}, "There is no head under the cursor: nothing was picked.")
            return {'CANCELLED'}
        self.uv = uv
        return self.execute(context)

    def work(self, context):
        item = captures.require(context)
        item.skin_tone = colour_at(shown_image(captures.require_head(context, item)), self.uv)
        item.use_skin_tone = True


def uv_under(window, event, head) -> tuple[float, float] | None:
    """Where on the texture the mouse points, in whichever 3D view it is over."""
    for area in window.screen.areas:
        region = next((r for r in area.regions if r.type == 'WINDOW'), None)
        if area.type != 'VIEW_3D' or not (
            0 <= event.mouse_x - region.x < region.width and 0 <= event.mouse_y - region.y < region.height
        ):
            continue
        at = event.mouse_x - region.x, event.mouse_y - region.y
        region_3d = area.spaces.active.region_3d
        return uv_on(
            head,
            view3d_utils.region_2d_to_origin_3d(region, region_3d, at),
            view3d_utils.region_2d_to_vector_3d(region, region_3d, at),
        )
    return None


def uv_on(head, origin: Vector, direction: Vector) -> tuple[float, float] | None:
    """UV where a ray, in the world, first meets the head's skin; None beside it, or on eyes, mouth and teeth, whose UVs
    lie in other tiles."""
    inverse = head.matrix_world.inverted()
    hit, point, _, face = head.ray_cast(inverse @ origin, inverse.to_3x3() @ direction)
    if not hit:
        return None
    mesh = head.evaluated_get(bpy.context.evaluated_depsgraph_get()).data  # as it is shown: a face may be made
    mesh.calc_loop_triangles()
    candidates = []
    for triangle in (t for t in mesh.loop_triangles if t.polygon_index == face):
        corners = [mesh.vertices[v].co for v in triangle.vertices]
        weights = barycentric_transform(point, *corners, Vector((1, 0, 0)), Vector((0, 1, 0)), Vector((0, 0, 1)))
        uv = sum(
            (w * mesh.uv_layers[0].data[loop].uv for w, loop in zip(weights, triangle.loops, strict=True)),
            Vector((0, 0)),
        )
        candidates.append((min(weights), tuple(uv)))
    u, v = max(candidates)[1]  # the one triangle of the polygon that the point is inside of
    return (u, v) if 0 <= u <= 1 and 0 <= v <= 1 else None


def shown_image(head) -> bpy.types.Image:
    """The image of the skin material's active node, which Solid shading shows."""
    material = head.data.materials[0] if head.data.materials else None  # others are eyes and mouth
    node = material.node_tree.nodes.active if material is not None and material.node_tree is not None else None
    image = getattr(node, "image", None)
    if image is None or not image.size[0]:
        raise Problem(
            "The head shows no texture to pick from.",
            "Click Bring In Head or Assemble Material, or set the colour by hand.",
        )
    return image


def colour_at(image: bpy.types.Image, uv) -> tuple[float, float, float]:
    """Mean of the image around a UV as sRGB in [0, 1], averaged as light is: linearly."""
    width, height = image.size
    column, row = int(uv[0] * width), int(uv[1] * height)  # Blender's rows go up
    reach = max(1, round(PATCH_SIDE_SHARE * width))
    top, left = max(0, row - reach), max(0, column - reach)
    patch = read_pixels(image)[top : row + reach + 1, left : column + reach + 1, :3]
    if not image.is_float:  # bytes are as in the file, sRGB; float images are in the scene's working space already
        patch = np.where(patch <= 0.04045, patch / 12.92, ((patch + 0.055) / 1.055) ** 2.4)
    mean = colours.from_working(patch.mean((0, 1))) if image.is_float else patch.mean((0, 1))
    return tuple(
        float(c) for c in np.where(mean <= 0.0031308, 12.92 * mean, 1.055 * np.clip(mean, 0, 1) ** (1 / 2.4) - 0.055)
    )


CLASSES = (WILDCAP_OT_pick_skin_tone,)
