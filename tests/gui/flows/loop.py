# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's loop: the sample head, a mask painted on the head and on the sheet, the real solver, the material, a
picture.

Nothing is called that an artist could not click, except where a file browser would open.
"""

import shutil
import subprocess
import time
from pathlib import Path

import addon
import bpy
import driver as d
import numpy as np
import painting
from addon import head
from mathutils import Vector
from painting import mask, on_disk

CHEEK = Vector((0.3, -1.0, -0.1))
"""Where the person's left cheek is, right on the screen, seen from the middle of the head."""
SHADOW, RADIUS = 0.4, 0.045
"""What is left of the light in a shadow cast on that cheek, and its radius in UV: the brush is wider."""
LIMIT_S = 1700
SHADE = """
import sys
import numpy as np
from pathlib import Path
from core.imaging import images

root, u, v, radius, left = Path(sys.argv[1]), *map(float, sys.argv[2:])
texture = images.read_linear(root / "texture.exr")
rows, columns = np.mgrid[:len(texture), :len(texture)] + 0.5
distance = np.hypot(columns / len(texture) - u, 1 - rows / len(texture) - v)
texture = texture * (1 - (1 - left) * np.clip((radius - distance) / 0.006 + 0.5, 0, 1))[..., None].astype(np.float32)
images.write_linear(root / "texture.exr", texture)
images.write_srgb(root / "texture.png", images.linear_to_srgb(texture))
"""


def flow():
    yield from d.open_tab("WildCap")
    d.screenshot("1_new")
    root = yield from addon.open_sample_head()
    shade(root)
    yield from paint(root)
    yield from solve(root)
    lit_as_painted(root)
    yield from relight(root)


def shade(root: Path) -> None:
    """Casts a shadow on the left cheek of the capture's texture: what a mask is there for, in a place that is known."""
    place = painting.uv_under(head(), painting.facing(head(), CHEEK))
    subprocess.run(
        [addon.CHECKOUT / ".venv" / "bin" / "python", "-c", SHADE, root, *map(str, (*place, RADIUS, SHADOW))],
        cwd=addon.CHECKOUT,
        check=True,
    )


def paint(root: Path):
    """From a capture that is finished up to its mask: strokes in 3D and on the sheet arrive in shadow_mask.png where
    they were painted."""
    addon.unsolved(root)
    brushes = {b.name for b in bpy.data.brushes}
    shading = view_shading()
    yield 1.5
    yield from d.press("wildcap.paint_mask")
    yield from painting.in_hand()
    before = mask()
    d.screenshot("3_mask_on_head")

    x, y = painting.facing(head(), CHEEK)
    assert x > d.middle()[0]
    texel = painting.texel(painting.uv_under(head(), (x, y)), len(before))
    # What is in the proposal already cannot change: the stroke goes where the mask is empty, or takes away where it is
    # full.
    erase = bool(before[texel] > 0.5)
    yield from painting.dab(x, y, ctrl=erase)
    after = mask()
    assert abs(float(after[texel]) - float(before[texel])) > 0.5, (texel, before[texel], after[texel])
    changed = np.argwhere(np.abs(after - before) > 0.5)
    d.say(f"3D stroke changed {len(changed)} texels around {np.round(changed.mean(0))}, aimed at {texel}")
    d.screenshot("4_stroke_on_head")
    stroked = time.monotonic()
    yield from painting.kept(root / "shadow_mask.png", after)
    assert bpy.context.mode == 'PAINT_TEXTURE'
    d.say(f"The stroke was in shadow_mask.png after {time.monotonic() - stroked:.1f} s, with the brush still in hand")

    yield from d.key('Z', ctrl=True)
    assert np.abs(mask() - before).max() < 0.01, "Ctrl-Z takes the stroke back"
    assert bpy.context.mode == 'PAINT_TEXTURE'
    yield from d.key('Z', ctrl=True, shift=True)
    assert np.abs(mask() - after).max() < 0.01, "Ctrl-Shift-Z brings it again"

    yield from d.press("wildcap.paint_mask", "SHEET")
    yield 1.0
    size = after.shape[0]
    corner = Vector((0.4, 0.4, 0.0))  # in half sides: U 0.7, V 0.7
    sheet = bpy.data.objects["WildCap Mask Sheet"]
    x, y = painting.on_screen(sheet.matrix_world @ (corner * 0.2))
    sheet_texel = round(0.3 * size), round(0.7 * size)
    erase = bool(after[sheet_texel] > 0.5)
    yield from d.stroke([(x - 8 + 2 * i, y) for i in range(9)], ctrl=erase)
    painted = mask()
    assert abs(float(painted[sheet_texel]) - float(after[sheet_texel])) > 0.5, sheet_texel
    yield from d.park()
    d.screenshot("5_stroke_on_sheet")

    yield from d.press("wildcap.finish_mask")
    yield from d.until(lambda: bpy.context.mode == 'OBJECT', "leaving", 5)
    saved = on_disk(root / "shadow_mask.png")
    assert np.abs(saved - painted).max() < 0.01
    assert view_shading() == shading
    # where Blender has a library of brushes, it links one as it enters the mode
    own = bpy.context.scene.tool_settings.image_paint.brush
    assert {b.name for b in bpy.data.brushes} == brushes | ({own.name} if own is not None else set())
    assert "WildCap Mask Sheet" not in bpy.data.objects
    d.say("shadow_mask.png holds both strokes")


def view_shading() -> tuple[str, str, str]:
    shading = d.view().spaces.active.shading
    return shading.type, shading.light, shading.color_type


def solve(root: Path):
    """The real worker, as a draft; its progress is seen in the panel."""
    addon.use_solver()
    addon.draft(steps=12, checkpoint_every=3)
    yield 1.5
    yield from d.press("wildcap.solve")
    assert addon.job(root) is not None, addon.problem(root)
    started = time.monotonic()
    yield from d.until(lambda: addon.job(root) is None or addon.job(root).previews > 0, "the first preview", 600)
    assert addon.job(root) is not None, addon.problem(root)
    assert 0 < addon.job(root).progress.done < addon.job(root).progress.of
    yield 1.5
    d.screenshot("6_solve_running")
    yield from d.until(lambda: addon.job(root) is None, "the solver's end", 900)
    assert not addon.problem(root), addon.problem(root)
    assert (root / "maps" / "diffuse_albedo.png").is_file()
    d.say(f"Solved after {time.monotonic() - started:.0f} s")


def lit_as_painted(root: Path) -> None:
    """The light the solver found is as dark under the stroke on the left cheek as the shadow that was cast there, and
    not darker on the right one."""
    shading = painting.on_disk(root / "maps" / "shading.exr")
    u, v = painting.uv_under(head(), painting.facing(head(), CHEEK))
    found = {}
    for side, across in (("left", u), ("right", 1 - u)):
        rows, columns = np.mgrid[: len(shading), : len(shading)] + 0.5
        distance = np.hypot(columns / len(shading) - across, 1 - rows / len(shading) - v)
        found[side] = float(
            np.median(shading[distance < 0.6 * RADIUS])
            / np.median(shading[(distance > 1.4 * RADIUS) & (distance < 2.2 * RADIUS)])
        )
    d.say(
        f"Light inside of the place against around it: left cheek {found['left']:.2f}, right cheek "
        f"{found['right']:.2f}; the shadow left {SHADOW}"
    )
    assert abs(found["left"] - SHADOW) < 0.15 and 0.95 < found["right"] < 1.05, found


def relight(root: Path):
    """The material and a small picture."""
    yield 1.5
    yield from d.press("wildcap.assemble_material")
    image = head().data.materials[0].node_tree.nodes["WildCap Albedo"].image
    assert Path(bpy.path.abspath(image.filepath)).is_relative_to(root) and image.colorspace_settings.name == 'sRGB'
    d.screenshot("7_assembled")
    bpy.context.scene.wildcap.resolution, bpy.context.scene.wildcap.samples = 320, 96
    yield 1.5
    yield from d.press("wildcap.render")
    yield from d.until(lambda: (root / "renders" / "three_point.png").is_file(), "the picture", 120)
    yield 2.0
    d.screenshot("8_rendered")
    shutil.copyfile(root / "renders" / "three_point.png", d.OUT / "9_three_point.png")
