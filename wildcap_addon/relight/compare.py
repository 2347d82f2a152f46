# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator that shows the skin as filmed, as delit, solved, or without hair, in one material at one exposure."""

import bpy

from ...core.capture.messages import Problem
from ...core.capture.newest_maps import find_newest_maps
from .. import captures, head, tones
from ..base_operator import BaseOperator
from . import material

ALBEDO = material.IMAGES[0][0]
SHOWN = {
    'FILMED': ("As Filmed", "filmed.png", "The texture with all of its light, as it was filmed"),
    'DELIT': ("Delit", "delit.png", "The texture that the delighter left, with the shadows that stayed in it"),
    'SOLVED': ("Albedo", "diffuse_albedo.png", "Solved albedo"),
    'SKIN': (
        "Skin Below Hair",
        "clean_albedo.png",
        "The albedo without brows, lashes and beard, for hair to grow over",
    ),
}
REMEDIES = (
    "Click Solve: it writes the pictures to compare, as long as the frames are there.",
    "Switch on Hair among the settings of 4K Maps, and run that stage.",
)


class WILDCAP_OT_compare(BaseOperator, bpy.types.Operator):
    """Show the head with its texture as filmed, as delit, with the solved albedo, or that of the skin below the hair;
    all at one exposure, renders included"""

    bl_idname = "wildcap.compare"
    bl_label = "Compare"
    bl_options = {'REGISTER', 'UNDO'}

    show: bpy.props.EnumProperty(
        name="Show", items=[(kind, label, tip) for kind, (label, _, tip) in SHOWN.items()], default='SOLVED'
    )

    @classmethod
    def poll(cls, context):
        if not (cls.in_object_mode(context) and cls.with_capture(context)):
            return False
        return cls.allowed(skin(context) is not None, "There is no skin material yet: click Assemble Material")

    def work(self, context):
        item = captures.require(context)
        name = SHOWN[self.show][1]
        maps = find_newest_maps(captures.folder(item))[0].parent
        path = (maps if self.show in ('SOLVED', 'SKIN') else captures.folder(item).comparison) / name
        if not path.is_file():
            raise Problem(f"This capture has no {name} to show.", REMEDIES[self.show == 'SKIN'])
        skin(context).node_tree.nodes[ALBEDO].image = head.load_image(path)
        tones.show(item)


def skin(context) -> bpy.types.Material | None:
    """Return the assembled material of the active capture's head."""
    item = captures.active(context)
    obj = captures.head(context, item) if item is not None else None
    first = obj.data.materials[0] if obj is not None and obj.data.materials else None  # others are eyes and mouth
    return first if first is not None and material.KEY in first and ALBEDO in first.node_tree.nodes else None


def shown_picture(context) -> str:
    """Return the key of SHOWN that the head shows."""
    skin_material = skin(context)
    image = skin_material.node_tree.nodes[ALBEDO].image if skin_material is not None else None
    name = bpy.path.basename(image.filepath) if image is not None else ""
    return next((kind for kind, (_, file_name, _) in SHOWN.items() if file_name == name), 'SOLVED')


CLASSES = (WILDCAP_OT_compare,)
