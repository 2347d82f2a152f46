# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a panel draws, without a window: its `draw` called with a layout that only takes notes."""

import bpy


class Layout:
    """Notes the texts that panels draw, where `translate` says whether Blender would look them up itself, and the
    operators of their buttons."""

    def __init__(self, drawn: list, buttons: list | None = None):
        self.drawn, self.buttons = drawn, [] if buttons is None else buttons

    def __getattr__(self, name):
        def call(*arguments, text="", translate=True, **options):
            if text:
                self.drawn.append((text, translate))
            if name == "operator":
                self.buttons.append(arguments[0])
            inner = Layout(self.drawn, self.buttons)
            return (inner, inner) if name == "panel" else inner

        return call


def drawn(kind) -> list[tuple[str, bool]]:
    """(text, whether Blender translates it) of all that a panel draws."""
    return _notes(kind)[0]


def buttons(kind) -> list[str]:
    """The operators that a panel has buttons for."""
    return _notes(kind)[1]


def _notes(kind) -> tuple[list, list]:
    found: tuple[list, list] = [], []
    panel = type("Drawn", (), {"layout": Layout(*found), "bl_label": kind.bl_label})()
    kind.draw(panel, bpy.context)
    return found
