# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From the texture and the mask to the maps."""

import bpy

from .. import incoming
from . import eyedropper, live, operators, panel, swatch_icons, tone_panel, white_card

RESULTS = incoming.Results(live.take, live.waits)
_register, _unregister = bpy.utils.register_classes_factory(
    (*operators.CLASSES, *eyedropper.CLASSES, *white_card.CLASSES, *tone_panel.CLASSES, *panel.CLASSES)
)


def register():
    _register()
    incoming.on_results.append(RESULTS)


def unregister():
    incoming.on_results.remove(RESULTS)
    _unregister()
    live.forget()
    swatch_icons.forget()
