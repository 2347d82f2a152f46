# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender itself takes with all maps of a capture loaded, and how long a save of a painted mask holds its main
thread, in a process of its own.

    python -m benchmarks.blender_memory CAPTURE [--resolution 64]

Memory is the process's resident set, GiB, with its peak so far (Linux): of the empty Blender, with the head and the
assembled material, after Cycles has rendered it (which loads every map), and with a mask of 4096 texels opened and
read. The time is that of `keeping.Saving`, the main thread's part of a save; beside it that of copying as many bytes,
which says how loaded the machine is. The capture is copied first and not changed.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import tempfile
import time
from importlib import import_module
from pathlib import Path

from .render_capture import without_numpy_1

ROOT = Path(__file__).resolve().parent.parent
MODULE = "bl_ext.user_default.wildcap"
MASK = 4096


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("capture", type=Path)
    parser.add_argument("--resolution", type=int, default=64)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        # Blender finds the checkout as an installed extension, under the very name users get.
        (Path(folder) / "extensions" / "user_default").mkdir(parents=True)
        (Path(folder) / "extensions" / "user_default" / "wildcap").symlink_to(ROOT, target_is_directory=True)
        os.environ["BLENDER_USER_RESOURCES"] = folder
        capture = Path(folder) / "face.wildcap"
        shutil.copytree(options.capture, capture, ignore=shutil.ignore_patterns("delit", "checkpoints", "logs"))
        with without_numpy_1():
            import bpy  # noqa: F401  (makes addon_utils importable)
        import addon_utils

        addon_utils.enable(MODULE, default_set=True)
        try:
            measure(capture, options.resolution)
        finally:
            addon_utils.disable(MODULE, default_set=True)  # a class left registered crashes the wheel at exit


def measure(capture: Path, resolution: int) -> None:
    """Prints the figures. Raises SystemExit when the capture has no maps."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True)
    say("empty Blender")
    bpy.ops.wildcap.open_capture(directory=str(capture))
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    say("head and material")
    bpy.context.scene.wildcap.resolution, bpy.context.scene.wildcap.samples = resolution, 4
    bpy.ops.wildcap.render()
    say(f"rendered at {resolution} px")
    for image in bpy.data.images:
        if image.size[0]:
            image.pixels[0]  # loads it, as a viewport that shows it does
    loaded = [image for image in bpy.data.images if image.size[0]]
    say("every picture loaded: "
        + ", ".join(f"{Path(image.filepath).name or image.name} {image.size[0]}" for image in loaded))
    save_a_mask(Path(capture))
    say(f"a mask of {MASK} read")


def save_a_mask(folder: Path) -> None:
    import bpy
    import numpy as np

    keeping = import_module(f"{MODULE}.wildcap_addon.paint.keeping")
    image = bpy.data.images.new("mask", MASK, MASK)
    capture = import_module(f"{MODULE}.core.contract.capture").Capture(folder)
    keeping.prepare(image)
    time.sleep(3)
    held = []
    for _ in range(4):
        started = time.perf_counter()
        saving = keeping.Saving(image, capture, 'SHADOW', ())
        held.append(time.perf_counter() - started)
        saving.result()
    other = np.ones(MASK * MASK * 4, np.float32)
    into = other.copy()
    started = time.perf_counter()
    into[:] = other
    copying = time.perf_counter() - started
    print(f"a save of a mask of {MASK} holds Blender for {min(held) * 1e3:.0f} ms (the first time {held[0] * 1e3:.0f} "
          "ms); "
          f"copying as many bytes takes {copying * 1e3:.0f} ms", flush=True)


def say(what: str) -> None:
    now = int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 2**30
    print(f"{now:5.2f} GiB now, {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:5.2f} GiB at most: {what}",
          flush=True)


if __name__ == "__main__":
    main()
