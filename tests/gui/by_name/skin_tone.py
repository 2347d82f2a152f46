# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The skin tone and the white point by their buttons, on the finished sample capture that `make demo` leaves (.demo/),
with a grey card drawn into its frames: click on the card in a frame, estimate, choose by hand."""

import shutil
from pathlib import Path

import addon
import bpy
import driver as d
import numpy as np

LIMIT_S = 1000

CARD = 0.5, 0.12  # u and v of its middle in a frame
GREY = 117 / 255  # sRGB of 18 percent under a light of 1


def flow():
    capture = Path.home() / "WildCap" / "sample.wildcap"
    shutil.copytree(addon.CHECKOUT / ".demo" / "sample.wildcap", capture)
    draw_card(capture / "frames")
    addon.unfold("WILDCAP_PT_solve")
    yield from d.open_tab("WildCap")
    addon.use_solver()
    bpy.ops.wildcap.open_capture(directory=str(capture))
    bpy.ops.wildcap.bring_in_head()
    yield 2.0
    yield from d.press("wildcap.pick_white_point", "grey")
    yield 1.0
    area = next(area for area in d.window().screen.areas if area.type == 'IMAGE_EDITOR')
    d.screenshot("white_point_frame")
    region = next(r for r in area.regions if r.type == 'WINDOW')
    x, y = region.view2d.view_to_region(*CARD, clip=False)
    d.event('WHEELDOWNMOUSE', 'PRESS', (region.x + x, region.y + y))
    yield 0.5
    d.event('MOUSEMOVE', 'NOTHING', (region.x + x, region.y + y))
    d.event('LEFTMOUSE', 'PRESS', (region.x + x, region.y + y))
    d.event('LEFTMOUSE', 'RELEASE', (region.x + x, region.y + y))
    yield 1.0
    white = [float(v) for v in addon.settings().solve.white_point.split(",")]
    d.say("white point", white)
    assert all(abs(v - 1) < 0.05 for v in white), "the card's light is what it was drawn in"
    assert d.view().type == 'VIEW_3D', "the 3D view is back"
    bpy.ops.wildcap.estimate_skin_tone()
    yield from d.until(lambda: addon.settings().tone_source == "white point", "the estimate", 500)
    item = addon.settings()
    d.say("estimated", tuple(round(c, 3) for c in item.skin_tone), item.tone_group, item.tone_deviation)
    assert item.use_skin_tone and item.tone_deviation > 0
    yield from d.park()
    yield 1.0
    d.screenshot("skin_tone_estimated")


def draw_card(frames: Path) -> None:
    """A grey square into the frames around the middle one, which is shown first."""
    paths = sorted(frames.glob("*.jpg"))
    for path in paths[len(paths) // 2 - 1 : len(paths) // 2 + 3]:
        image = bpy.data.images.load(str(path))
        width, height = image.size
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
        picture = pixels.reshape(height, width, 4)
        column, row, reach = int(CARD[0] * width), int(CARD[1] * height), width // 12
        picture[row - reach : row + reach, column - reach : column + reach, :3] = GREY
        image.pixels.foreach_set(picture.ravel())
        image.file_format = 'JPEG'
        image.save(filepath=str(path))
        bpy.data.images.remove(image)
