# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of the tab's panels for docs/guide, unfolded, on the finished sample capture that `make demo` leaves
(.demo/); and the eyedropper clicked."""

import shutil
import subprocess
from pathlib import Path

import addon
import bpy
import driver as d

LIMIT_S = 300

PANELS = ("stages", "capture", "frames", "reconstruct", "delighter", "solve", "relight")
STEPS, TURNS, TABS_PX = 14, 4, 22
ARTIST = Path("/home/anna")
"""The folder that the picture names, gone with the chroot's /home: the test's own home has a temporary name."""


def flow():
    capture = ARTIST / "WildCap" / "sample.wildcap"
    shutil.copytree(addon.CHECKOUT / ".demo" / "sample.wildcap", capture)
    addon.unfold(*(f"WILDCAP_PT_{name}" for name in PANELS))
    yield from d.open_tab("WildCap")
    addon.use_solver()
    bpy.ops.wildcap.open_capture(directory=str(capture))
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    bpy.context.scene.wildcap.light = 'hdri'
    yield 3.0
    bpy.ops.wildcap.compare_delit()
    yield from pick()
    for kind in ('FILMED', 'DELIT', 'SOLVED'):
        bpy.ops.wildcap.compare(show=kind)
        yield 1.5
        d.screenshot(f"compare_{kind.lower()}")
    shots = []
    for i in range(TURNS):
        shots.append((yield from shot(f"panels_{i}")))
        yield from d.scroll(STEPS)
    subprocess.run(["convert", *map(str, shots), "+append", str(d.OUT / "panels.png")], check=True, timeout=60)


def pick():
    """Pick Skin Tone by its button and a click on the cheek: the colour is the texture's there."""
    item = addon.settings()
    bpy.ops.wildcap.pick_skin_tone('INVOKE_DEFAULT')
    yield 0.3
    x, y = d.middle()
    yield from d.click((x - 40, y - 30))
    assert item.use_skin_tone, "the click picked a tone"
    red, green, blue = item.skin_tone
    assert red > green > blue > 0.1, tuple(item.skin_tone)
    d.say("picked", tuple(round(c, 2) for c in item.skin_tone))


def shot(name: str):
    """The sidebar alone, without the names of the tabs; its path."""
    yield from d.park()
    yield 0.7
    path, sidebar = d.screenshot(name), d.region('UI')
    top = d.window().height - sidebar.y - sidebar.height
    inside = f"{sidebar.width - TABS_PX}x{sidebar.height}+{sidebar.x}+{top}"
    subprocess.run(["convert", str(path), "-crop", inside, "+repage", str(path)], check=True, timeout=60)
    return path
