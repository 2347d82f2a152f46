# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The way from an empty Blender to an own head, as flows share it: the zip dragged into the window, a Python that has
the solver's packages, the video, and a job by the large button; what the whole took is counted.

The Python is chosen, as the line below Install Solver offers: that would download gigabytes.
"""

import json
import os
import shutil
import time
from pathlib import Path

import addon
import bpy
import driver as d
import numpy as np

VIDEO = addon.CHECKOUT / "research" / "people" / "sample" / "capture.mp4"


def drag_in_zip():
    """The zip dropped on the 3D view, by the operator that Blender calls for it, and its dialog confirmed. Returns when
    (time.monotonic)."""
    started = time.monotonic()
    assert addon.INSTALLED not in bpy.context.preferences.addons, "the flow begins without the add-on"
    d.act()
    with d.in_view():
        bpy.ops.extensions.package_install_files('INVOKE_DEFAULT', url=os.environ["WILDCAP_GUI_ZIP"])
    yield 1.0
    d.screenshot("walk_0_dropped")
    yield from d.key('RET')
    yield from d.until(lambda: addon.INSTALLED in bpy.context.preferences.addons, "the add-on", 60)
    return started


def choose_python():
    """Use an Existing Python, from the tab of a Blender that has just got the add-on."""
    yield from d.open_tab("WildCap")
    d.screenshot("walk_1_empty")
    yield from d.press("wildcap.use_python")
    yield from d.browse(addon.CHECKOUT / ".venv" / "bin" / "python")
    yield from d.until(lambda: addon.module("preferences").python() is not None, "the solver's Python", 60)
    yield 1.0


def choose_video():
    """The sample video, and settings by which all takes minutes; returns the capture's folder."""
    yield from d.lead("wildcap.choose_video")
    yield from d.browse(VIDEO)
    quick(addon.settings())
    bpy.context.scene.wildcap.resolution, bpy.context.scene.wildcap.samples = 512, 16
    yield 1.5
    d.screenshot("walk_2_video")
    return Path(addon.module("captures").root(addon.settings()))


def quick(settings) -> None:
    """Minutes matter here, detail does not; an artist leaves these folded away."""
    settings.quality = "draft"
    settings.frames.max_frames, settings.frames.long_side, settings.frames.views = 40, 640, 8
    settings.scan.pairs, settings.scan.voxel_mm = 8, 2.0
    settings.texture.size = 512
    settings.solve.size, settings.solve.steps, settings.solve.checkpoint_every = 128, 12, 3
    settings.upscale.size = 1024
    settings.transfer.scan = False


def begin(command: str, root: Path):
    """The leading button's job, under way."""
    yield from d.lead(command)
    assert addon.job(root) is not None, addon.problem(root) or addon.problem()


def make(root: Path, picture: str = ""):
    """The large button's way from a video to a solved head in its material."""
    yield from begin("wildcap.make_my_head", root)
    if picture:
        yield 12.0
        d.screenshot(picture)
    yield from d.until(lambda: head() is not None or addon.job(root) is None, "the head in the scene", 1200)
    assert addon.job(root) is not None, addon.problem(root)
    d.say("the head comes in while it is solved")
    yield from ended("wildcap.make_my_head", root)
    assert addon.problem(root).startswith("Your head is ready."), addon.problem(root)


def ended(command: str, root: Path):
    """The end of that job."""
    yield from d.until(lambda: addon.job(root) is None, f"the end of {command}", 1200)
    found = addon.module("status").of(addon.settings())
    d.say(f"    {found.seconds if found else ''}")


def head():
    return addon.module("captures").head(bpy.context, addon.settings())


def lit_face(root: Path):
    """Waits for the picture of the head under three lamps, and looks whether it is one; it is in the test's folder,
    too."""
    picture = root / "renders" / "three_point.png"
    yield from d.until(picture.is_file, "the picture", 240)
    yield 2.0
    shutil.copyfile(picture, d.OUT / "walk_5_picture.png")
    image = bpy.data.images.load(str(picture))
    pixels = np.array(image.pixels[:]).reshape(*image.size, 4)[..., :3]
    inside = pixels[200:300, 200:300]
    assert 0.05 < inside.mean() < 0.95 and inside[..., 0].mean() > inside[..., 2].mean(), "a lit face"


def count(way: str, started: float) -> None:
    """Says how many clicks and minutes lie between a moment and now, and leaves them in clicks_WAY.json."""
    found = {
        "blender": bpy.app.version_string,
        "clicks": d.actions(),
        "minutes": round((time.monotonic() - started) / 60, 1),
    }
    (d.OUT / f"clicks_{way}.json").write_text(json.dumps(found) + "\n", encoding="utf-8")
    d.say(
        f"{found['clicks']} clicks and {found['minutes']} min from dragging the zip to a relit own head, in Blender "
        f"{found['blender']}"
    )
