# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's loop: the sample head, a mask painted on the head and on the sheet, the real solver, the material, a picture.

Nothing is called that an artist could not click, except where a file browser would open.
"""

import shutil
import sys
import time
from pathlib import Path

import bpy
import numpy as np
from bpy_extras import view3d_utils
from mathutils import Vector
from mathutils.geometry import barycentric_transform

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import driver as d  # noqa: E402

CHECKOUT = Path(__file__).resolve().parents[3]


def flow():
    root = yield from open_sample_head()
    yield from paint(root)
    yield from solve(root)
    yield from relight(root)


def open_sample_head():
    """From an empty profile to a head that can be relit, within ten seconds."""
    yield from d.open_tab("WildCap")
    yield from d.park()
    d.screenshot("1_new")
    position = yield from d.find("wildcap.open_sample_head")
    started = time.monotonic()
    yield from d.click(position)
    yield from d.until(lambda: head() is not None, "the sample head", 10)
    d.say(f"Sample head after {time.monotonic() - started:.1f} s")
    assert "WildCap Skin" in head().data.materials[0].node_tree.nodes
    yield from d.park()
    yield 1.5
    d.screenshot("2_sample_head")
    return Path(head()["wildcap_capture"])


def paint(root: Path):
    """From a capture that is finished up to its mask: strokes in 3D and on the sheet arrive in shadow_mask.png where they were painted."""
    for folder in ("maps", "renders"):
        shutil.rmtree(root / folder, ignore_errors=True)
    brushes = {b.name for b in bpy.data.brushes}
    shading = d.view().spaces.active.shading.type, d.view().spaces.active.shading.light, d.view().spaces.active.shading.color_type
    yield 1.5
    yield from d.press("wildcap.paint_mask")
    yield from d.until(lambda: bpy.context.mode == 'PAINT_TEXTURE', "texture painting", 5)
    before = mask_in_blender()
    yield 0.5
    d.screenshot("3_mask_on_head")

    x, y = on_screen(head(), Vector((0.3, -1.0, -0.1)))  # the person's left cheek, right on the screen
    assert x > d.middle()[0]
    texel = texel_under((x, y))
    # What is in the proposal already cannot change: the stroke goes where the mask is empty, or takes away where it is full.
    erase = before[texel] > 0.5
    yield from d.stroke([(x - 12 + 3 * i, y) for i in range(9)], ctrl=erase)
    after = mask_in_blender()
    assert abs(float(after[texel]) - float(before[texel])) > 0.5, (texel, before[texel], after[texel])
    changed = np.argwhere(np.abs(after - before) > 0.5)
    d.say(f"3D stroke changed {len(changed)} texels around {np.round(changed.mean(0))}, aimed at {texel}")
    d.screenshot("4_stroke_on_head")
    stroked = time.monotonic()
    kept = root / "shadow_mask.png"
    yield from d.until(lambda: kept.is_file() and np.abs(read_grey(kept) - after).max() < 0.01, "the mask in the capture", 5)
    assert bpy.context.mode == 'PAINT_TEXTURE'
    d.say(f"The stroke was in shadow_mask.png after {time.monotonic() - stroked:.1f} s, with the brush still in hand")

    yield from d.key('Z', ctrl=True)
    assert np.abs(mask_in_blender() - before).max() < 0.01, "Ctrl-Z takes the stroke back"
    assert bpy.context.mode == 'PAINT_TEXTURE'
    yield from d.key('Z', ctrl=True, shift=True)
    assert np.abs(mask_in_blender() - after).max() < 0.01, "Ctrl-Shift-Z brings it again"

    yield from d.press("wildcap.paint_mask", "SHEET")
    yield 1.0
    size = after.shape[0]
    corner = Vector((0.4, 0.4, 0.0))  # in half sides: U 0.7, V 0.7
    sheet = bpy.data.objects["WildCap Mask Sheet"]
    x, y = on_screen(sheet, None, sheet.matrix_world @ (corner * 0.2))
    sheet_texel = round(0.3 * size), round(0.7 * size)
    erase = after[sheet_texel] > 0.5
    yield from d.stroke([(x - 8 + 2 * i, y) for i in range(9)], ctrl=erase)
    painted = mask_in_blender()
    assert abs(float(painted[sheet_texel]) - float(after[sheet_texel])) > 0.5, sheet_texel
    yield from d.park()
    d.screenshot("5_stroke_on_sheet")

    yield from d.press("wildcap.finish_mask")
    yield from d.until(lambda: bpy.context.mode == 'OBJECT', "leaving", 5)
    saved = read_grey(root / "shadow_mask.png")
    assert np.abs(saved - painted).max() < 0.01
    assert (d.view().spaces.active.shading.type, d.view().spaces.active.shading.light, d.view().spaces.active.shading.color_type) == shading
    assert {b.name for b in bpy.data.brushes} == brushes
    assert "WildCap Mask Sheet" not in bpy.data.objects
    d.say("shadow_mask.png holds both strokes")


def solve(root: Path):
    """The real worker, as a draft; its progress is seen in the panel."""
    bpy.ops.wildcap.use_python(filepath=str(CHECKOUT / ".venv"))  # a file browser otherwise
    settings = bpy.context.scene.wildcap.captures[0]
    settings.quality = "draft"
    settings.solve.size, settings.solve.steps, settings.solve.checkpoint_every = 128, 12, 3  # minutes matter here, detail does not
    settings.upscale.size = 1024
    yield 1.5
    yield from d.press("wildcap.solve")
    jobs = sys.modules["bl_ext.user_default.wildcap.wildcap_addon.jobs"]
    problems = sys.modules["bl_ext.user_default.wildcap.wildcap_addon.problems"]
    assert jobs.of(str(root)) is not None, problems.of(str(root))
    started = time.monotonic()
    yield from d.until(lambda: jobs.of(str(root)) is None or jobs.of(str(root)).previews > 0, "the first preview", 600)
    assert jobs.of(str(root)) is not None, str(problems.of(str(root)))
    assert 0 < jobs.of(str(root)).progress.done < jobs.of(str(root)).progress.of
    yield 1.5
    d.screenshot("6_solve_running")
    yield from d.until(lambda: jobs.of(str(root)) is None, "the solver's end", 900)
    assert problems.of(str(root)) is None, str(problems.of(str(root)))
    assert (root / "maps" / "diffuse_albedo.png").is_file()
    d.say(f"Solved after {time.monotonic() - started:.0f} s")


def relight(root: Path):
    """The material and a small picture."""
    yield 1.5
    yield from d.press("wildcap.assemble_material")
    image = head().data.materials[0].node_tree.nodes["WildCap Albedo"].image
    assert Path(bpy.path.abspath(image.filepath)).is_relative_to(root) and image.colorspace_settings.name == 'sRGB'
    d.screenshot("7_assembled")
    bpy.context.scene.wildcap.resolution, bpy.context.scene.wildcap.samples = 256, 8
    yield 1.5
    yield from d.press("wildcap.render")
    yield from d.until(lambda: (root / "renders" / "studio.png").is_file(), "the picture", 120)
    yield 2.0
    d.screenshot("8_rendered")
    shutil.copyfile(root / "renders" / "studio.png", d.OUT / "9_studio.png")


def head():
    return bpy.data.objects.get("sample_head")


def mask_in_blender() -> np.ndarray:
    """The mask being painted [H, W] in [0, 1], rows from the top. Data-blocks are looked up anew: an undo replaces them."""
    image = bpy.context.scene.tool_settings.image_paint.stencil_image
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return np.flipud(pixels.reshape(image.size[1], image.size[0], -1)[..., 0]).copy()


def read_grey(path: Path) -> np.ndarray:
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = 'Non-Color'
    pixels = np.array(image.pixels[:], np.float32).reshape(image.size[1], image.size[0], -1)[..., 0]
    bpy.data.images.remove(image)
    return np.flipud(pixels)


def on_screen(obj, towards: Vector | None, point: Vector | None = None) -> tuple[float, float]:
    """Window pixels of a world point, or of where a ray from outside along -`towards` meets the object."""
    if point is None:
        centre = sum((Vector(c) for c in obj.bound_box), Vector()) / 8
        start = centre + towards.normalized()
        hit, point, _, _ = obj.ray_cast(start, (centre - start).normalized())
        assert hit
        point = obj.matrix_world @ point
    region = d.region()
    x, y = view3d_utils.location_3d_to_region_2d(region, d.view().spaces.active.region_3d, point)
    return region.x + x, region.y + y


def texel_under(position) -> tuple[int, int]:
    """(row, column) of the mask under a window position: a ray to the head, and the UV where it hits."""
    region, region_3d = d.region(), d.view().spaces.active.region_3d
    inside = position[0] - region.x, position[1] - region.y
    origin = view3d_utils.region_2d_to_origin_3d(region, region_3d, inside)
    direction = view3d_utils.region_2d_to_vector_3d(region, region_3d, inside)
    to_local = head().matrix_world.inverted()
    hit, point, _, face = head().ray_cast(to_local @ origin, to_local.to_3x3() @ direction)
    assert hit, "the head is under the cursor"
    mesh = head().data
    mesh.calc_loop_triangles()
    for triangle in mesh.loop_triangles:
        if triangle.polygon_index == face:
            corners = [mesh.vertices[v].co for v in triangle.vertices]
            uvs = [Vector((*mesh.uv_layers[0].data[loop].uv, 0)) for loop in triangle.loops]
            uv = barycentric_transform(point, *corners, *uvs)
            if -0.01 <= min(uv.x, uv.y):
                break
    height, width = mask_in_blender().shape
    return int((1 - uv.y) * height), int(uv.x * width)


d.play(flow(), limit_s=1700)
