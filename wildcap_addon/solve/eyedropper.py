# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator that picks the skin tone by a click on the head.

It reads the texture, not the screen, where Blender's own eyedropper would find it shaded.
"""

import bpy
from bpy_extras import view3d_utils
from mathutils import Vector
from mathutils.geometry import barycentric_transform

from ...core.capture.messages import Problem
from .. import captures, colours, tones
from ..base_operator import BaseOperator
from ..data_blocks import read_pixels

PATCH_SIDE_SHARE = 1 / 128
"""Half the side of the averaged square, in UV: large enough to level pores and freckles."""


class WILDCAP_OT_pick_skin_tone(BaseOperator, bpy.types.Operator):
    """Click on evenly lit skin of the head: the texture's mean colour there becomes the skin tone. Esc cancels."""

    bl_idname = "wildcap.pick_skin_tone"
    bl_label = "Pick Skin Tone"
    bl_options = {'REGISTER', 'UNDO'}

    uv: bpy.props.FloatVectorProperty(
        name="UV", size=2, description="Place on the texture, set by a click in the 3D view"
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
            navigating = event.type in ('MIDDLEMOUSE', 'WHEELUPMOUSE', 'WHEELDOWNMOUSE')
            return {'PASS_THROUGH' if navigating else 'RUNNING_MODAL'}
        context.window.cursor_modal_restore()
        uv = uv_under(context.window, event, captures.require_head(context, captures.require(context)))
        if uv is None:
            self.report({'WARNING'}, "There is no head under the cursor: nothing was picked.")
            return {'CANCELLED'}
        self.uv = uv
        return self.execute(context)

    def work(self, context):
        item = captures.require(context)
        tones.choose(item, colour_at(shown_image(captures.require_head(context, item)), self.uv))


def uv_under(window, event, head) -> tuple[float, float] | None:
    """Return the UV under the mouse, in any 3D view."""
    for area in window.screen.areas:
        region = next((r for r in area.regions if r.type == 'WINDOW'), None)
        x, y = (event.mouse_x - region.x, event.mouse_y - region.y) if area.type == 'VIEW_3D' else (-1, -1)
        if area.type == 'VIEW_3D' and 0 <= x < region.width and 0 <= y < region.height:
            view = region, area.spaces.active.region_3d, (x, y)
            origin = view3d_utils.region_2d_to_origin_3d(*view)
            return uv_on(head, origin, view3d_utils.region_2d_to_vector_3d(*view))
    return None


def uv_on(head, origin: Vector, direction: Vector) -> tuple[float, float] | None:
    """Return the UV where a ray in the world meets the head's skin; None beside it, or on eyes, mouth and teeth.

    The UVs of the latter lie in other tiles.
    """
    inverse = head.matrix_world.inverted()
    hit, point, _, face = head.ray_cast(inverse @ origin, inverse.to_3x3() @ direction)
    if not hit:
        return None
    mesh = head.evaluated_get(bpy.context.evaluated_depsgraph_get()).data  # with its current expression
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
    u, v = max(candidates)[1]  # of the polygon's triangle that contains the point
    return (u, v) if 0 <= u <= 1 and 0 <= v <= 1 else None


def shown_image(head) -> bpy.types.Image:
    """Return the image of the skin material's active node, which Solid shading shows."""
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
    """Return the mean of the image around a UV as sRGB in [0, 1], averaged in linear light."""
    width, height = image.size
    column, row = int(uv[0] * width), int(uv[1] * height)  # Blender's rows go up
    reach = max(1, round(PATCH_SIDE_SHARE * width))
    top, left = max(0, row - reach), max(0, column - reach)
    patch = read_pixels(image)[top : row + reach + 1, left : column + reach + 1, :3]
    if image.is_float:  # in the scene's working space
        mean = colours.from_working(patch.mean((0, 1)))
    else:  # bytes are sRGB, as in the file
        mean = colours.srgb_to_linear(patch).mean((0, 1))
    return tuple(map(float, colours.linear_to_srgb(mean)))


CLASSES = (WILDCAP_OT_pick_skin_tone,)
