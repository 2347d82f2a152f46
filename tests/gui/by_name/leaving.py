# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A painting session's ends, in the window: leaving gives the artist's things back, a file saved in the middle goes on, and six seconds after a stroke
it is on the disk, where another Blender finds it."""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import driver as d  # noqa: E402

FIND = """
import bpy, sys
import numpy as np
image = bpy.data.images.load(sys.argv[-1])
image.colorspace_settings.name = 'Non-Color'
np.save(sys.argv[-1] + '.npy', np.array(image.pixels[:], np.float32).reshape(image.size[1], image.size[0], -1)[..., 0])
"""


def flow():
    yield from d.open_tab("WildCap")
    yield from d.park()
    yield from d.press("wildcap.open_sample_head")
    yield from d.until(lambda: "sample_head" in bpy.data.objects, "the sample head", 20)
    root = Path(bpy.data.objects["sample_head"]["wildcap_capture"])
    yield 1.0
    yield from leave()
    yield from reopen(root)
    yield from killed(root)


def leave():
    """The artist sculpts on something else, in another shading and with the tint of an own project set."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
    bpy.ops.object.mode_set(mode='SCULPT')
    space = d.view().spaces.active
    space.shading.light, space.shading.color_type, space.overlay.show_overlays = 'MATCAP', 'RANDOM', False
    paint = bpy.context.scene.tool_settings.image_paint
    paint.stencil_color, paint.canvas = (0.25, 0.5, 0.75), bpy.data.images.new("My Canvas", 8, 8)
    bpy.ops.ed.undo_push()
    before = state()
    yield from d.park()
    bpy.ops.wildcap.paint_mask()
    yield 1.0
    x, y = d.middle()
    old = mask()
    yield from d.stroke([(x - 12 + 3 * i, y) for i in range(9)], ctrl=bool(old.mean() > 0.5))
    assert np.abs(mask() - old).max() > 0.4
    yield from d.lead("wildcap.finish_mask")
    yield 1.0
    assert state() == before, (before, state())
    d.say("left as it was", before["mode"])
    bpy.ops.object.mode_set(mode='OBJECT')


def reopen(root: Path):
    """Saved while painting, opened again: the brush is in hand, and a stroke still reaches the capture."""
    blend = Path(tempfile.mkdtemp()) / "middle.blend"
    bpy.ops.wildcap.paint_mask()
    yield 1.0
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    painted = mask()
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    yield 2.0
    assert bpy.context.mode == 'PAINT_TEXTURE' and np.abs(mask() - painted).max() < 0.01
    yield from d.open_tab("WildCap")
    x, y = d.middle()
    old = mask()
    yield from d.stroke([(x - 40 + 3 * i, y - 50) for i in range(9)])
    assert np.abs(mask() - old).max() > 0.4, "the mask brush is still in hand"
    yield from d.park()
    d.screenshot("painting_goes_on")
    yield from d.lead("wildcap.finish_mask")
    yield 1.0
    assert bpy.context.mode == 'OBJECT' and not any("WildCap" in brush.name for brush in bpy.data.brushes)
    d.say("went on after opening the file")


def killed(root: Path):
    """What the disk holds six seconds after a stroke is all that would be left if Blender were killed now: another Blender reads it."""
    bpy.ops.wildcap.paint_mask()
    yield 1.0
    x, y = d.middle()
    yield from d.stroke([(x - 60 + 3 * i, y + 60) for i in range(9)])
    yield 6.0
    found = Path(tempfile.mkdtemp()) / "found.png"
    shutil.copyfile(root / "shadow_mask.png", found)
    (found.parent / "find.py").write_text(FIND)
    subprocess.run(["blender", "-b", "--factory-startup", "-P", str(found.parent / "find.py"), "--", str(found)], check=True, timeout=120, capture_output=True)
    assert np.abs(np.load(f"{found}.npy") - mask()).max() < 0.01
    d.say("six seconds after a stroke another Blender finds it")


def state() -> dict:
    space, paint = d.view().spaces.active, bpy.context.scene.tool_settings.image_paint
    return {"mode": bpy.context.mode, "active": bpy.context.view_layer.objects.active.name, "selected": sorted(o.name for o in bpy.context.selected_objects),
            "shading": [getattr(space.shading, name) for name in ("type", "light", "color_type")], "overlays": space.overlay.show_overlays,
            "opacity": space.overlay.texture_paint_mode_opacity, "canvas": paint.canvas.name, "stencil": [paint.use_stencil_layer, paint.stencil_image,
            tuple(paint.stencil_color)], "brushes": sorted(b.name for b in bpy.data.brushes), "brush": paint.brush.name if paint.brush else None}


def mask() -> np.ndarray:
    image = bpy.context.scene.tool_settings.image_paint.stencil_image
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(image.size[1], image.size[0], -1)[..., 0].copy()


d.play(flow(), limit_s=600)
