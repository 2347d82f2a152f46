# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What eyes, mouth and hair take in Blender: the click on each button, and a render with all of them.

    python -m research.benchmarks.costs acting CAPTURE [--resolution 512] [--samples 32] [--json
    research/records/acting_costs.json]

CAPTURE is solved, with 4K maps that have hair; it is copied first and not changed. Seconds are the operator's, as the
artist waits for it; memory is what Blender holds more, once that is done, in MiB (Linux); the render is Cycles' on the
processor, of the head as *Render* frames it, without and with close-up eyes and hair, and its peak that of the whole
process so far. Captures measured earlier stay in the record.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from pathlib import Path

from ..figures import write_record
from ..render_capture import extension
from .meter import MIB, peak, resident, spending

BUTTONS = {"add_face_units": "Add Face Units", "close_up": "Close-Up Eyes", "grow_hair": "Grow Hair"}
"""Operator and what the panel calls it, in the order in which they are clicked."""


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(
        "python -m research.benchmarks.costs acting",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("capture", type=Path)
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--json", type=Path, help="where the figures go")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        capture = Path(folder) / "face.wildcap"
        shutil.copytree(
            options.capture, capture, ignore=shutil.ignore_patterns("frames", "delit", "checkpoints", "logs", "renders")
        )
        with extension():
            found = measure(capture, options.resolution, options.samples)
    if options.json:
        write_record(
            options.json,
            "costs",
            "python -m research.benchmarks.costs acting CAPTURE",
            {
                "resolution": options.resolution,
                "samples": options.samples,
                "faces": {options.capture.resolve().stem: found},
            },
            keep=True,
        )


def measure(capture: Path, resolution: int, samples: int) -> dict:
    """Operator -> seconds and MiB more, None where it was done already; "plain" and "render": seconds and the peak in
    MiB of a render without and with them all; hairs and vertices: what was added."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wildcap.open_capture(directory=str(capture))
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    bpy.context.scene.wildcap.resolution, bpy.context.scene.wildcap.samples = resolution, samples
    head = bpy.context.view_layer.objects.active
    found, known = {"plain": render()}, set(bpy.data.objects)
    for button, title in BUTTONS.items():
        if button == "add_face_units" and head.data.shape_keys:
            found[button] = None  # filmed with open eyes: Assemble Material added them
            continue
        before = resident()
        bpy.context.view_layer.objects.active = head
        with spending() as spent:
            getattr(bpy.ops.wildcap, button)()
            bpy.context.view_layer.update()
        found[button] = {"seconds": spent.seconds, "mib": (resident() - before) / MIB}
        print(f"{title}: {spent.seconds:.1f} s, {found[button]['mib']:.0f} MiB more", flush=True)
    found["render"] = render()
    added = set(bpy.data.objects) - known
    return {
        **found,
        "hairs": sum(len(thing.data.curves) for thing in added if thing.type == 'CURVES'),
        "vertices": sum(len(thing.data.vertices) for thing in added if thing.type == 'MESH'),
    }


def render() -> dict[str, float]:
    """Of *Render*, as it is set."""
    import bpy

    with spending() as spent:
        bpy.ops.wildcap.render()
    print(f"rendered: {spent.seconds:.1f} s, {peak() / MIB:.0f} MiB at most so far", flush=True)
    return {"seconds": spent.seconds, "peak_mib": peak() / MIB}
