# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From the video to the textured head."""

import bpy

from . import choices, colours, delighters, operators, panel, sending

_register, _unregister = bpy.utils.register_classes_factory(
    (*operators.CLASSES, *choices.CLASSES, *colours.CLASSES, *sending.CLASSES, *panel.CLASSES)
)


def register():
    _register()
    bpy.types.WindowManager.wildcap_wipe = bpy.props.FloatProperty(
        name="Wipe",
        subtype='FACTOR',
        min=0,
        max=1,
        default=0.5,
        options={'SKIP_SAVE'},
        description="Left of the edge the frame as it was shot, right of it without its light",
        update=lambda manager, _: delighters.move(manager.wildcap_wipe),
    )


def unregister():
    del bpy.types.WindowManager.wildcap_wipe
    delighters.forget()
    _unregister()
