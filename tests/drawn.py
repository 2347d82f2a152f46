# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a panel draws, without a window: its `draw` called with a layout that only takes notes."""

import bpy


class Layout:
    """Notes the texts that panels draw; `translate` says whether Blender would look them up itself."""

    def __init__(self, drawn: list):
        self.drawn = drawn

    def __getattr__(self, name):
        def call(*arguments, text="", translate=True, **options):
            if text:
                self.drawn.append((text, translate))
            return (Layout(self.drawn), Layout(self.drawn)) if name == "panel" else Layout(self.drawn)

        return call


def drawn(kind) -> list[tuple[str, bool]]:
    """(text, whether Blender translates it) of all that a panel draws."""
    found: list = []
    panel = type("Drawn", (), {"layout": Layout(found), "bl_label": kind.bl_label})()
    kind.draw(panel, bpy.context)
    return found
