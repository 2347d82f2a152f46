# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The Relight panel, wide and narrow; contact sheet, turntable, Esc, and the same from a terminal; Cycles and EEVEE agree on the lit cheek."""

import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import addon  # noqa: E402
import driver as d  # noqa: E402

CHEEK = (0.45, 0.38, 0.04)
"""Middle from the lower left, and half a side, of a square on the lit cheek, as shares of the picture."""
ENGINES_AGREE = 0.15
"""Largest difference of the two engines' mean there, as a share: EEVEE scatters on the screen and has no light from wall to wall."""


def flow():
    addon.unfold("WILDCAP_PT_relight")
    root = yield from addon.open_sample_head()
    yield from panel()
    yield from contact_sheet(root)
    yield from turntable(root)
    from_a_terminal(root)
    yield from engines(root)


def panel():
    yield 0.5
    d.screenshot("relight_wide")
    props = bpy.context.scene.wildcap
    x, y = yield from d.find("wildcap.render")
    yield from d.click((x - 20, y - 24))
    props.light = 'hdri'
    yield from scroll(8)
    d.screenshot("relight_turntable_hdri")
    sidebar = d.region('UI')
    width, middle = sidebar.width, sidebar.y + sidebar.height / 2
    yield from d.stroke([(sidebar.x - 1, middle)] + [(sidebar.x - 1 + 6 * i, middle) for i in range(1, 16)])
    yield from scroll(1)
    d.screenshot("relight_narrow")
    d.say(f"sidebar {width} px wide, then {d.region('UI').width}")
    props.light, props.resolution, props.samples = 'three_point', 64, 2


def scroll(steps: int):
    """Turns the wheel over the sidebar, and has it drawn."""
    sidebar = d.region('UI')
    position = sidebar.x + sidebar.width // 3, sidebar.y + sidebar.height // 2
    yield from d.move(position)
    for _ in range(steps):
        d.event('WHEELDOWNMOUSE', 'PRESS', position)
        yield 0.05
    sidebar.tag_redraw()
    yield from d.park()
    yield 0.5


def contact_sheet(root: Path):
    sheet = root / "renders" / "contact_sheet.png"
    yield from d.press("wildcap.contact_sheet")
    yield from d.until(sheet.is_file, "the contact sheet", 180)
    image = bpy.data.images.load(str(sheet))
    assert tuple(image.size) == (192, 2 * 64 + 3 * 8), tuple(image.size)
    assert all((root / "renders" / f"{name}.{kind}").is_file() for name in ("three_point", "coloured") for kind in ("png", "exr"))
    d.say("contact sheet")


def turntable(root: Path):
    """Stopped by Esc it leaves nothing; then a short one."""
    props, folder = bpy.context.scene.wildcap, root / "renders" / "turntable"
    hidden = folder.with_name(".turntable")
    props.turn_file, props.turn_frames, props.turns = 'PNG', 500, 'LIGHT'
    yield from scroll(8)
    yield from d.press("wildcap.turntable")
    yield from d.until(lambda: hidden.is_dir() and len(list(hidden.iterdir())) > 1, "two frames", 180)
    yield from d.key('ESC')
    yield from d.until(lambda: not bpy.app.is_job_running('RENDER') and not hidden.exists(), "the end after Esc", 30)
    assert not folder.exists()
    props.turn_frames = 3
    yield 0.5
    yield from d.press("wildcap.turntable")
    yield from d.until(folder.is_dir, "the turntable", 180)
    assert sorted(p.name for p in folder.iterdir()) == ["0001.png", "0002.png", "0003.png"]
    d.say("turntable, stopped and whole")


def from_a_terminal(root: Path) -> None:
    (root / "renders" / "window.png").unlink()
    command = ["blender", "--command", "wildcap", "relight", str(root), "window", "--resolution", "32", "--samples", "1"]
    done = subprocess.run(command, env=os.environ, capture_output=True, text=True, timeout=180)
    assert done.returncode == 0 and (root / "renders" / "window.png").is_file(), done.stdout[-2000:] + done.stderr[-2000:]
    d.say("blender --command wildcap relight")


def engines(root: Path):
    """One light, one camera, the same maps; without the denoiser, in linear light."""
    picture, headless = addon.module("relight.picture"), addon.module("relight.headless")
    mean = {}
    for engine in ("CYCLES", "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0, 0) else "BLENDER_EEVEE"):
        scene = picture.set_up(addon.head(), "three_point", 128, 32)
        scene.render.engine = engine
        if engine != "CYCLES":
            scene.eevee.taa_render_samples = 32
        path = root / "renders" / f"{engine.lower()}.png"
        headless.output.still(scene, path, True)
        yield 0.5
        image = bpy.data.images.load(str(path.with_suffix(".exr")))
        pixels = np.array(image.pixels[:]).reshape(128, 128, 4)[..., :3]
        x, y, half = (int(128 * share) for share in CHEEK)
        mean[engine] = pixels[y - half:y + half, x - half:x + half].mean((0, 1))
        d.say(engine, mean[engine].round(3))
        subprocess.run(["convert", str(path), str(d.OUT / f"relight_{engine.lower()}.png")], check=True, timeout=60)
    cycles, eevee = mean.values()
    d.say(f"EEVEE over Cycles on the lit cheek: {(eevee / cycles).round(3)}")
    assert np.abs(eevee / cycles - 1).max() < ENGINES_AGREE, mean


d.play(flow(), limit_s=900)
