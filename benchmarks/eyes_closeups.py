# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Close-ups of the sample head's eye and mouth, plain and with Close-Up Eyes, by the add-on's own buttons:

    python -m benchmarks.eyes_closeups FOLDER OUT.jpg [--resolution 512] [--samples 64]

Columns: the eye open, half closed, looking aside, and the mouth open. Rows: as Add Face Units leaves it in Cycles, then with the close-up in Cycles and in
EEVEE. Light Three-Point, view transform Standard. FOLDER keeps the capture and the renders; finished renders are taken as they are.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
LIGHT = "three_point"
AWAY_M = 0.45
EYE, MOUTH = (0.030, -0.008, -0.001), (0.0, -0.012, -0.075)
"""What the camera looks at, metres in the head's axes: the eye on the person's left, the mouth."""
SHOTS = {
    "open": (1.0, {}, EYE, (0.3, -1.0, 0.05), 420.0),
    "half": (0.5, {}, EYE, (0.3, -1.0, 0.05), 420.0),
    "aside": (1.0, {"eyeLookOutLeft": 1.0, "eyeLookInRight": 1.0}, EYE, (0.3, -1.0, 0.05), 420.0),
    "mouth": (1.0, {"jawOpen": 0.6, "mouthUpperUpLeft": 0.5, "mouthUpperUpRight": 0.5}, MOUTH, (0.15, -1.0, 0.0), 190.0),
}
"""Name -> how far the lids are open, units, what the camera looks at, from where, and its lens in millimetres."""
ROWS = (("plain", "CYCLES"), ("close_up", "CYCLES"), ("close_up", "EEVEE"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--render", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.render:
        render(asked.folder, asked.resolution, asked.samples)
        return
    from core.imaging import images

    from .gallery import write_small

    again = [sys.executable, "-m", "benchmarks.eyes_closeups", str(asked.folder), str(asked.out), "--render",
             "--resolution", str(asked.resolution), "--samples", str(asked.samples)]
    subprocess.run(again, cwd=ROOT, check=True)
    write_small(asked.out, np.concatenate([np.concatenate([images.read_srgb(picture(asked.folder, *row, name)) for name in SHOTS], 1) for row in ROWS]))


def picture(folder: Path, what: str, engine: str, name: str) -> Path:
    return folder / f"{what}_{engine.lower()}_{name}.png"


def render(folder: Path, resolution: int, samples: int) -> None:
    """The renders that are not there yet."""
    from .render_capture import extension

    with extension():
        import bpy
        from bl_ext.user_default.wildcap.core.contract import sample_head
        from bl_ext.user_default.wildcap.wildcap_addon import captures, head
        from bl_ext.user_default.wildcap.wildcap_addon.relight import material

        kept = sorted(folder.glob("*.wildcap"))
        item = captures.add(bpy.context, kept[0] if kept else sample_head.copy_to(folder).root)
        thing = head.bring_in(bpy.context, item)
        material.assemble(bpy.context, item)
        bpy.ops.wildcap.add_face_units()
        bpy.ops.wildcap.grow_hair()
        for what, engine in ROWS:
            if (what == "close_up") != bool(captures.close_up(thing)):
                bpy.ops.wildcap.close_up()
            for name in SHOTS:
                path = picture(folder, what, engine, name)
                if not path.is_file():
                    shoot(thing, name, engine, (resolution, samples), path)


def shoot(thing, name: str, engine: str, quality: tuple[int, int], path: Path) -> None:
    """Renders one picture; quality: pixels of a side, and samples."""
    import bpy
    from bl_ext.user_default.wildcap.wildcap_addon.relight import picture as scenes
    from mathutils import Vector

    opened, units, at, way, lens = SHOTS[name]
    keys = thing.data.shape_keys
    bpy.ops.wildcap.rest_face()
    keys["eyesOpen"] = opened
    for unit, value in units.items():
        keys.key_blocks[unit].value = value
    keys.update_tag()
    scene = scenes.set_up(thing, LIGHT, *quality)
    if engine == "EEVEE":
        scene.render.engine = 'BLENDER_EEVEE_NEXT' if bpy.app.version < (5, 0, 0) else 'BLENDER_EEVEE'
        scene.eevee.taa_render_samples = quality[1]
    place = thing.matrix_world @ Vector(at)
    scene.camera.matrix_world.translation = place + AWAY_M * Vector(way).normalized()
    scene.camera.rotation_euler = (place - scene.camera.matrix_world.translation).to_track_quat('-Z', 'Y').to_euler()
    scene.camera.data.lens, scene.camera.data.clip_start = lens, 0.01
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True, scene=scene.name)


if __name__ == "__main__":
    main()
