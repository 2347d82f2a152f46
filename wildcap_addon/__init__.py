# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Add-on: everything that runs inside Blender. Of `core` it imports the ground floor; a worker does the heavy work.

The rooms register in this order and unregister in reverse.
"""

from . import (
    acting,
    batch,
    batches,
    capture,
    deliver,
    frame_icons,
    groom,
    head,
    jobs,
    layers,
    links,
    make,
    paint,
    panel,
    preferences,
    properties,
    reconstruct,
    relight,
    setup,
    solve,
    status,
    terminal,
    timings,
    tones,
)

ROOMS = (
    frame_icons,
    preferences,
    properties,
    tones,
    layers,
    head,
    panel,
    setup,
    capture,
    reconstruct,
    paint,
    solve,
    relight,
    make,
    acting,
    groom,
    deliver,
    links,
    status,
    timings,
    jobs,
    batches,
    batch,
    terminal,
)


def register():
    for room in ROOMS:
        room.register()


def unregister():
    for room in reversed(ROOMS):
        room.unregister()
