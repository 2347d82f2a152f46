# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender itself takes with all maps of a capture loaded, and how long a save of a painted mask holds its main
thread, in a process of its own.

    python -m research.benchmarks.costs blender CAPTURE [--resolution 64] [--json OUT.json]

Memory is what the process holds, and its peak so far (Linux), in GiB: of the empty Blender, with the head and the
assembled material, after Cycles has rendered it (which loads every map), and with a mask of 4096 texels opened and
read. The time is that of `keeping.Saving`, the main thread's part of a save; beside it that of copying as many bytes,
which says how loaded the machine is. The capture is copied first and not changed.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from importlib import import_module
from pathlib import Path

from ..figures import write_record
from ..render_capture import EXTENSION, extension
from .meter import GIB, peak, resident, spending

MASK = 4096


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(
        "python -m research.benchmarks.costs blender",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("capture", type=Path)
    parser.add_argument("--resolution", type=int, default=64)
    parser.add_argument("--json", type=Path, help="where the figures go, such as research/records/blender_memory.json")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        capture = Path(folder) / "face.wildcap"
        shutil.copytree(options.capture, capture, ignore=shutil.ignore_patterns("delit", "checkpoints", "logs"))
        with extension():
            found = measure(capture, options.resolution)
    if options.json:
        write_record(options.json, "costs", "python -m research.benchmarks.costs blender CAPTURE", found)


def measure(capture: Path, resolution: int) -> dict:
    """The record's figures, printed on the way: what is held by the empty Blender and with every map shown, and the
    most until then and with the mask."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True)
    empty, _ = say("empty Blender")
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
    shown, loading = say(
        "every picture loaded: "
        + ", ".join(f"{Path(image.filepath).name or image.name} {image.size[0]}" for image in loaded)
    )
    save_a_mask(capture)
    _, opened = say(f"a mask of {MASK} read")
    return {"empty_gb": empty, "shown_gb": shown, "loading_gb": loading, "mask_opened_gb": opened}


def save_a_mask(folder: Path) -> None:
    import bpy
    import numpy as np

    keeping = import_module(f"{EXTENSION}.wildcap_addon.paint.keeping")
    image = bpy.data.images.new("mask", MASK, MASK)
    capture = import_module(f"{EXTENSION}.core.capture.capture").Capture(folder)
    keeping.prepare(image)
    time.sleep(3)
    held = []
    for _ in range(4):
        with spending() as saving:
            begun = keeping.Saving(image, capture, 'SHADOW', ())
        held.append(saving.seconds)
        begun.result()
    other = np.ones(MASK * MASK * 4, np.float32)
    into = other.copy()
    with spending() as copying:
        into[:] = other
    print(
        f"a save of a mask of {MASK} holds Blender for {min(held) * 1e3:.0f} ms (the first time {held[0] * 1e3:.0f} "
        f"ms); copying as many bytes takes {copying.seconds * 1e3:.0f} ms",
        flush=True,
    )


def say(what: str) -> tuple[float, float]:
    """Prints and returns the GiB that are held now and the most so far."""
    now, most = round(resident() / GIB, 2), round(peak() / GIB, 2)
    print(f"{now:5.2f} GiB now, {most:5.2f} GiB at most: {what}", flush=True)
    return now, most
