# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From an empty Blender to a picture with the large button alone: a video, one brush stroke, and never another button of the tab.

But for one: Install Solver would download gigabytes, so the worker's Python is chosen, as the line below that button offers.
"""

import shutil
import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import driver as d  # noqa: E402
from addon import CHECKOUT, module  # noqa: E402
from painting import in_hand, mask  # noqa: E402

VIDEO = CHECKOUT / "core" / "synthetic" / "sample" / "capture.mp4"


def flow():
    yield from d.open_tab("WildCap")
    yield from d.park()
    d.screenshot("walk_1_empty")
    yield from d.press("wildcap.use_python")
    yield from d.browse(CHECKOUT / ".venv" / "bin" / "python")
    yield from d.until(lambda: module("preferences").python() is not None, "the solver's Python", 60)
    yield 1.0

    yield from d.lead("wildcap.choose_video")
    yield from d.browse(VIDEO)
    settings = bpy.context.scene.wildcap.captures[0]
    root = module("captures").root(settings)
    quick(settings)
    yield 1.5
    d.screenshot("walk_2_video")
    yield from work("wildcap.reconstruct", root, "walk_3_reconstruct", 900)
    yield 1.5
    assert head() is not None, "the head came in by itself"
    d.screenshot("walk_4_head")

    yield from d.lead("wildcap.paint_mask")
    yield from in_hand()
    before = mask()
    x, y = d.middle()
    yield from d.stroke([(x + 10 + 3 * i, y - 20) for i in range(12)], ctrl=bool(before.mean() > 0.5))
    assert np.abs(mask() - before).max() > 0.4 or before.mean() > 0.05
    yield from d.park()
    d.screenshot("walk_5_stroke")
    yield from d.lead("wildcap.finish_mask")
    yield from d.until(lambda: bpy.context.mode == 'OBJECT', "leaving", 5)
    assert (Path(root) / "shadow_mask.png").is_file()
    yield 1.5

    yield from work("wildcap.solve", root, "walk_6_solve", 900)
    yield 1.5
    yield from d.lead("wildcap.assemble_material")
    d.screenshot("walk_7_material")
    bpy.context.scene.wildcap.resolution, bpy.context.scene.wildcap.samples = 512, 16
    yield 1.5
    yield from d.lead("wildcap.render")
    picture = Path(root) / "renders" / "three_point.png"
    yield from d.until(picture.is_file, "the picture", 180)
    yield 2.0
    d.screenshot("walk_8_rendered")
    shutil.copyfile(picture, d.OUT / "walk_9_picture.png")
    image = bpy.data.images.load(str(picture))
    pixels = np.array(image.pixels[:]).reshape(*image.size, 4)[..., :3]
    inside = pixels[200:300, 200:300]
    assert 0.05 < inside.mean() < 0.95 and inside[..., 0].mean() > inside[..., 2].mean(), "a lit face"


def quick(settings) -> None:
    """Minutes matter here, detail does not; an artist leaves these folded away."""
    settings.quality = "draft"
    settings.frames.max_frames, settings.frames.long_side, settings.frames.views = 72, 640, 8
    settings.scan.pairs, settings.scan.voxel_mm = 8, 2.0
    settings.texture.size = 512
    settings.solve.size, settings.solve.steps, settings.solve.checkpoint_every = 128, 12, 3
    settings.upscale.size = 1024
    settings.transfer.scan = False


def work(command: str, root: str, picture: str, limit_s: float):
    """The leading button's job, to its end."""
    jobs, problems = module("jobs"), module("problems")
    started = time.monotonic()
    yield from d.lead(command)
    assert jobs.of(root) is not None, str(problems.of(root) or problems.of(""))
    yield 12.0
    d.screenshot(picture)
    yield from d.until(lambda: jobs.of(root) is None, f"the end of {command}", limit_s)
    assert problems.of(root) is None, str(problems.of(root))
    d.say(f"{command}: {time.monotonic() - started:.0f} s")
    stages = module("status").of(bpy.context.scene.wildcap.captures[0])
    d.say(f"    {stages.seconds if stages else ''}")


def head():
    return module("captures").head(bpy.context, bpy.context.scene.wildcap.captures[0])


d.play(flow(), limit_s=1700)
