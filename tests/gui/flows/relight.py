# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact sheet and turntable by their buttons, a picture from a terminal, and a render stopped by Esc."""

import ctypes
import subprocess
from pathlib import Path

import addon
import bpy
import driver as d

ESCAPE = 0xFF1B
"""X11's symbol of the key"""


def flow():
    addon.unfold("WILDCAP_PT_relight")
    root = yield from addon.open_sample_head()
    x, y = yield from d.find("wildcap.render")
    yield from d.click((x - 20, y - 24))
    props = bpy.context.scene.wildcap
    props.light, props.resolution, props.samples = 'three_point', 64, 2
    yield from d.scroll(16)
    yield from contact_sheet(root)
    yield from turntable(root)
    from_a_terminal(root)
    yield from stopped(root)


def contact_sheet(root: Path):
    sheet = root / "renders" / "contact_sheet.png"
    yield from d.press("wildcap.contact_sheet")
    yield from d.until(sheet.is_file, "the contact sheet", 180)
    image = bpy.data.images.load(str(sheet))
    assert tuple(image.size) == (192, 2 * 64 + 3 * 8), tuple(image.size)
    assert all(
        (root / "renders" / f"{name}.{kind}").is_file()
        for name in ("three_point", "coloured")
        for kind in ("png", "exr")
    )
    d.say("contact sheet")


def turntable(root: Path):
    props, folder = bpy.context.scene.wildcap, root / "renders" / "turntable"
    props.turn_file, props.turn_frames, props.turns = 'PNG', 3, 'LIGHT'
    yield from d.scroll(8)
    yield from d.press("wildcap.turntable")
    yield from d.until(folder.is_dir, "the turntable", 180)
    assert sorted(p.name for p in folder.iterdir()) == ["0001.png", "0002.png", "0003.png"]
    d.say("turntable")


def from_a_terminal(root: Path) -> None:
    (root / "renders" / "window.png").unlink()
    options = ("window", "--resolution", "32", "--samples", "1")
    command = ["blender", "--command", "wildcap", "relight", root, *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=180)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert (root / "renders" / "window.png").is_file(), done.stdout[-2000:]
    d.say("blender --command wildcap relight")


def stopped(root: Path):
    """Esc in a turntable leaves the one before as it was. From then on there are no more clicks: see `escape`."""
    folder = root / "renders" / "turntable"
    before, hidden = folder.stat().st_mtime_ns, folder.with_name(".turntable")
    bpy.context.scene.wildcap.turn_frames = 1000
    yield 0.5
    yield from d.press("wildcap.turntable")
    yield from d.until(lambda: hidden.is_dir() and len(list(hidden.iterdir())) > 1, "two frames", 180)
    escape()
    yield from d.until(lambda: not hidden.exists(), "the end after Esc", 30)
    assert not bpy.app.is_job_running('RENDER'), "the render goes on"
    assert folder.is_dir() and folder.stat().st_mtime_ns == before, "the turntable before"
    d.say("stopped by Esc")


def escape() -> None:
    """The key from the X server, over the render's window: Blender looks for it where keys come in, past which
    simulated ones are made."""
    bpy.app.use_event_simulate = False  # it heeds no other keys while that is on
    x11, test = ctypes.CDLL("libX11.so.6"), ctypes.CDLL("libXtst.so.6")
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XKeysymToKeycode.argtypes, x11.XKeysymToKeycode.restype = [ctypes.c_void_p, ctypes.c_ulong], ctypes.c_ubyte
    display = ctypes.c_void_p(x11.XOpenDisplay(None))
    test.XTestFakeMotionEvent(
        display, 0, *(side // 2 for side in (d.window().width, d.window().height)), ctypes.c_ulong(0)
    )
    for pressed in (1, 0):
        test.XTestFakeKeyEvent(display, x11.XKeysymToKeycode(display, ESCAPE), pressed, ctypes.c_ulong(0))
    x11.XCloseDisplay(display)
