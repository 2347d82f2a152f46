# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From an empty Blender to a picture by one click: a video is chosen, Make My Head clicked, and nothing painted; clicks and minutes are counted.

The worker's Python is chosen, as the line below Install Solver offers: that would download gigabytes.
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
    bpy.context.scene.wildcap.resolution, bpy.context.scene.wildcap.samples = 512, 16
    yield 1.5
    d.screenshot("walk_2_video")
    started = time.monotonic()
    yield from work("wildcap.make_my_head", root)
    picture = Path(root) / "renders" / "three_point.png"
    yield from d.until(picture.is_file, "the picture", 240)
    yield 2.0
    d.say(f"one click, {(time.monotonic() - started) / 60:.1f} min to the picture")
    d.screenshot("walk_4_rendered")
    assert head() is not None and "wildcap_skin" in head().data.materials[0], "the head came in by itself, and its material"
    assert not (Path(root) / "shadow_mask.png").is_file(), "nobody painted"
    told = module("problems").of(root)
    assert told.problem == "Your head is ready.", str(told)
    shutil.copyfile(picture, d.OUT / "walk_5_picture.png")
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


def work(command: str, root: str):
    """The leading button's job, to its end; the head is there before that is."""
    jobs, problems = module("jobs"), module("problems")
    yield from d.lead(command)
    assert jobs.of(root) is not None, str(problems.of(root) or problems.of(""))
    yield 12.0
    d.screenshot("walk_3_making")
    yield from d.until(lambda: head() is not None or jobs.of(root) is None, "the head in the scene", 1200)
    assert jobs.of(root) is not None, str(problems.of(root))
    d.say("the head comes in while it is solved")
    yield from d.until(lambda: jobs.of(root) is None, f"the end of {command}", 900)
    found = module("status").of(bpy.context.scene.wildcap.captures[0])
    d.say(f"    {found.seconds if found else ''}")


def head():
    return module("captures").head(bpy.context, bpy.context.scene.wildcap.captures[0])


d.play(flow(), limit_s=1700)
