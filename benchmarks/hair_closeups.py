# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Close-ups of hair that was grown over the maps of six tones of skin, under three lights, by the add-on's own buttons:

    python -m benchmarks.hair_closeups FOLDER OUT.jpg [--resolution 256] [--samples 32]

A row for each person: the albedo with its painted brow under the first light, then with brows and lashes grown over the skin below under all three, the eyes
half open in the last. Maps and heads are the true ones of benchmarks/people.py, so the pictures show what growing hair does and nothing of a solve's errors.
Cycles's linear light under the sRGB curve (Blender's view transform Standard). FOLDER keeps captures and renders; finished renders are taken as they are.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
LIGHTS = ("three_point", "overcast", "sun")
HALF_OPEN = 0.5
BROW = (0.030, 0.006)
"""Where the camera looks, metres to the person's left and above the eyes of the built-in head."""
AWAY_M, LENS_MM = 0.45, 220.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--resolution", type=int, default=256)
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--render", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.render:
        render(asked.folder, asked.resolution, asked.samples)
        return
    from core.imaging import images

    from .gallery import write_small

    captures = [prepare(asked.folder, name, seed) for name, seed in people()]
    again = [sys.executable, "-m", "benchmarks.hair_closeups", str(asked.folder), str(asked.out), "--render",
             "--resolution", str(asked.resolution), "--samples", str(asked.samples)]
    subprocess.run(again, cwd=ROOT, check=True)
    rows = [np.concatenate([images.read_srgb(capture / "renders" / f"{name}.png") for name in shots()], 1) for capture in captures]
    write_small(asked.out, np.concatenate(rows))


def people() -> list[tuple[str, int]]:
    from .people import PEOPLE

    return [(person.name, person.seed) for person in PEOPLE]


def shots() -> dict[str, tuple[str, bool, float]]:
    """Picture -> its light, whether hair is grown, how far the eyes are open."""
    return {"painted": (LIGHTS[0], False, 0.0), **{f"grown_{light}": (light, True, HALF_OPEN * (light == LIGHTS[-1])) for light in LIGHTS}}


def prepare(folder: Path, name: str, seed: int) -> Path:
    """A capture with the true head and maps, and what the stage 4K Maps finds of its hair, made if it is not there."""
    from core import upscale
    from core.contract.capture import Capture
    from core.contract.messages import Reporter
    from core.contract.settings import from_json
    from core.face import template
    from core.geometry import meshes
    from core.imaging import images
    from core.synthetic.identities import subject_mesh
    from core.synthetic.parameters import sample_parameters
    from core.synthetic.skin import make_skin

    from .people import write_maps

    capture = Capture(folder / f"{name}.wildcap")
    if not (capture.maps_4k / "strands.npz").is_file():
        skin = make_skin(sample_parameters(seed))
        meshes.write_obj(capture.head, subject_mesh(seed))
        write_maps(capture.maps, skin)
        images.write_linear(capture.maps / "diffuse_albedo.exr", skin.diffuse)
        images.write_linear(capture.maps / "shading.exr", np.ones_like(skin.diffuse))
        images.write_data(capture.maps / "confidence.png", 0.9 * template.mask("face", len(skin.diffuse)))
        upscale.run(capture, from_json({"upscale": {"size": 2048, "method": "lanczos", "whole_head": False}}), Reporter("upscale"))
    return capture.root


def render(folder: Path, resolution: int, samples: int) -> None:
    """The renders of every capture of the folder that are not there yet."""
    from .render_capture import extension

    with extension():
        import bpy
        from bl_ext.user_default.wildcap.wildcap_addon import captures, head
        from bl_ext.user_default.wildcap.wildcap_addon.relight import material, picture

        for root in sorted(folder.glob("*.wildcap")):
            left = {name: shot for name, shot in shots().items() if not (root / "renders" / f"{name}.png").is_file()}
            if not left:
                continue
            bpy.ops.wm.read_homefile(use_empty=True)
            item = captures.add(bpy.context, root)
            thing = head.bring_in(bpy.context, item)
            material.assemble(bpy.context, item)
            bpy.ops.wildcap.add_face_units()
            for name, (light, hair, opened) in left.items():
                if hair and not captures.hair(thing):
                    bpy.ops.wildcap.grow_hair()
                thing.data.shape_keys["eyesOpen"] = opened
                thing.data.shape_keys.update_tag()
                scene = picture.set_up(thing, light, resolution, samples)
                aim(scene.camera, thing)
                scene.render.filepath = str(root / "renders" / f"{name}.png")
                bpy.ops.render.render(write_still=True, scene=scene.name)


def aim(camera, thing) -> None:
    """Points the camera at the brow and the eye on the person's left."""
    from mathutils import Vector

    vertices = thing.data.vertices
    front = min((vertex.co for vertex in vertices if abs(vertex.co.x - BROW[0]) < 0.004 and abs(vertex.co.z - BROW[1]) < 0.004), key=lambda place: place.y)
    at = thing.matrix_world @ Vector((BROW[0], front.y, BROW[1]))
    camera.matrix_world.translation = at + AWAY_M * Vector((0.35, -1.0, 0.1)).normalized()
    camera.rotation_euler = (at - camera.matrix_world.translation).to_track_quat('-Z', 'Y').to_euler()
    camera.data.lens, camera.data.clip_start = LENS_MM, 0.01


if __name__ == "__main__":
    main()
