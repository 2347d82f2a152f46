# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An artist's quarter of an hour in a Blender of its own, for test_habits.py: python habits.py [worker], with the
circumstances in the environment.

The extension is enabled from the folder it lies in, the sample head opened, relit, its mask painted on and left, a
stage's tool run by the real worker, settings written and read. Prints one JSON line of what was seen; a traceback
anywhere is its failure.
"""

import json
import locale
import os
import sys
import time
from importlib import import_module
from pathlib import Path

import bpy
import numpy as np

NAME = "bl_ext.user_default.wildcap"


def main() -> None:
    import addon_utils  # bpy has made it importable

    # what Blender's module prints when it is loaded beside another NumPy than its own is not the add-on's
    for stream in (sys.stdout, sys.stderr):
        print("Started.", file=stream, flush=True)
    locale.setlocale(locale.LC_ALL, "")  # as a toolkit does when it starts
    assert addon_utils.enable(NAME, default_set=True) is not None
    rooms = ("captures", "jobs", "preferences", "problems", "paint.session", "paint.mask_image")
    addon = {name: import_module(f"{NAME}.wildcap_addon.{name}") for name in rooms}
    bpy.ops.wildcap.open_sample_head()
    item = bpy.context.scene.wildcap.captures[0]
    capture, head = addon["captures"].folder(item), addon["captures"].head(bpy.context, item)
    seen = {
        "decimal_point": locale.localeconv()["decimal_point"],
        "capture": str(capture.root),
        "height_m": round(head.dimensions.z, 3),
    }
    seen["spaces"] = {
        node.name: node.image.colorspace_settings.name
        for node in head.active_material.node_tree.nodes
        if node.type == 'TEX_IMAGE'
    }
    props = bpy.context.scene.wildcap
    props.resolution, props.samples = 16, 1
    bpy.ops.wildcap.render()
    seen["render"] = (capture.renders / "three_point.png").is_file()
    bpy.ops.wildcap.paint_mask(on='HEAD')
    mask, image = addon["paint.mask_image"], addon["paint.session"].mask()
    seen["mask_space"] = image.colorspace_settings.name
    half = np.zeros(tuple(image.size)[::-1], np.float32)
    half[:, : half.shape[1] // 2] = 0.5
    mask.set_values(image, half)
    bpy.ops.wildcap.finish_mask()
    seen["mask"] = round(float(mask.mask_values(mask.load(capture))[:, :8].mean()), 2)
    item.solve.skin_tone = "auto"
    if "worker" in sys.argv:
        addon["preferences"].set_python(Path(sys.executable))
        bpy.ops.wildcap.estimate_skin_tone()
        while addon["jobs"].poll():
            time.sleep(0.05)
        problem = addon["problems"].of(str(capture.root))
        seen["problem"] = str(problem or "")
        seen["tone"] = [round(c, 3) for c in item.skin_tone]
    print("SEEN " + json.dumps(seen), flush=True)
    addon_utils.disable(NAME, default_set=True)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # the bpy 4.2 module crashes at its exit
