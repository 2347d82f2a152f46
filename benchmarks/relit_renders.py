# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Heads under the add-on's own lights, as linear EXR, in a process of its own (Blender's Python module):

    python -m benchmarks.relit_renders JOB.json

The job, written by benchmarks/relit.py, names captures (a head with maps each), lights, size, rays per pixel and the folder for CAPTURE_LIGHT.exr;
pictures that exist stay. One more, face.exr, holds the first capture's masks: red where the face is, green where there is head.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import bpy

from .render_capture import extension

WORLDS = Path(bpy.utils.system_resource('DATAFILES')) / "studiolights" / "world"


def main() -> None:
    job = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    out = Path(job["out"])
    with extension():
        from bl_ext.user_default.wildcap.wildcap_addon import captures, head
        from bl_ext.user_default.wildcap.wildcap_addon.hdri import Hdri
        from bl_ext.user_default.wildcap.wildcap_addon.relight import material, picture

        for row in job["rows"]:
            left = [light for light in job["lights"] if not (out / f"{row['name']}_{light}.exr").exists()]
            wanted = "face" not in [p.stem for p in out.glob("*.exr")]
            if not left and not wanted:
                continue
            bpy.ops.wm.read_homefile(use_empty=True)
            item = captures.add(bpy.context, Path(row["capture"]))
            thing = head.bring_in(bpy.context, item)
            material.assemble(bpy.context, item)
            for light in left:
                source = Hdri(WORLDS / light) if light.endswith(".exr") else light
                _render(picture.set_up(thing, source, job["resolution"], job["samples"]), out / f"{row['name']}_{light}.exr", row["seed"])
            if wanted:
                scene = picture.set_up(thing, job["lights"][0], job["resolution"], 16)
                thing.data.materials[0] = _shown(job["mask"])
                scene.cycles.use_denoising = False
                scene.world.use_nodes = False
                scene.world.color = (0, 0, 0)
                _render(scene, out / "face.exr", 0)


def _render(scene: bpy.types.Scene, path: Path, seed: int) -> None:
    scene.cycles.seed, scene.cycles.use_animated_seed = seed, False
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = 'OPEN_EXR', 'RGB', '32'
    scene.render.use_persistent_data = True
    scene.render.filepath = str(path.with_suffix(".part.exr"))
    bpy.ops.render.render(write_still=True, scene=scene.name)
    os.replace(path.with_suffix(".part.exr"), path)


def _shown(mask: str) -> bpy.types.Material:
    """A material that shines as a picture says, whatever the light."""
    material = bpy.data.materials.new("mask")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    image, emission, output = (nodes.new(kind) for kind in ("ShaderNodeTexImage", "ShaderNodeEmission", "ShaderNodeOutputMaterial"))
    image.image = bpy.data.images.load(mask)
    image.image.colorspace_settings.name = "Non-Color"
    links.new(image.outputs["Color"], emission.inputs["Color"])
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return material


if __name__ == "__main__":
    main()
