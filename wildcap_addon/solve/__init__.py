# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From the texture and the mask to the maps."""

import bpy

from . import eyedropper, operators, panel, preview, white_card

register, _unregister = bpy.utils.register_classes_factory(
    (*operators.CLASSES, *eyedropper.CLASSES, *white_card.CLASSES, *panel.CLASSES))


def unregister():
    _unregister()
    preview.forget()
