# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Render heads under the add-on's own lights to linear EXR, in a process of its own (Blender's Python module).

    python -m research.benchmarks.light.relit_renders JOB.json

The job, written by research/benchmarks/light/relit.py, names captures (a head with maps each), lights, size, rays per
pixel and the folder for CAPTURE_LIGHT.exr; pictures that exist stay. One more, face.exr, holds the first capture's
masks: red where the face is, green where there is head. Only the rectangle about the face is rendered; the rest stays
black.
"""

import json
import os
import sys
from pathlib import Path

import numpy as np

from ..pictures.render_capture import extension

MARGIN = 0.03  # about the face, of the picture's side


def main() -> None:
    job = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    out = Path(job["out"])
    with extension():
        import bpy  # no sooner: Blender looks for extensions when it is first imported
        from bl_ext.user_default.wildcap.wildcap_addon import captures, head
        from bl_ext.user_default.wildcap.wildcap_addon.hdri import Hdri
        from bl_ext.user_default.wildcap.wildcap_addon.relight import material, picture

        worlds = Path(bpy.utils.system_resource('DATAFILES')) / "studiolights" / "world"
        for row in job["rows"]:
            left = [light for light in job["lights"] if not (out / f"{row['name']}_{Path(light).stem}.exr").exists()]
            if not left:
                continue
            bpy.ops.wm.read_homefile(use_empty=True)
            item = captures.add(bpy.context, Path(row["capture"]))
            thing = head.bring_in(bpy.context, item)
            material.assemble(bpy.context, item)
            if not (out / "face.exr").exists():
                _render_mask(
                    thing, picture.set_up_scene(thing, left[0], job["resolution"], 16), job["mask"], out / "face.exr"
                )
            for light in left:
                source = Hdri(worlds / light) if light.endswith(".exr") else light
                scene = picture.set_up_scene(thing, source, job["resolution"], job["samples"])
                _about_face(scene, out / "face.exr")
                _render(scene, out / f"{row['name']}_{Path(light).stem}.exr", row["seed"])


def _render(scene, path: Path, seed: int) -> None:
    import bpy

    scene.cycles.seed, scene.cycles.use_animated_seed = seed, False
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = 'OPEN_EXR', 'RGB', '32'
    scene.render.use_persistent_data = True
    scene.render.filepath = str(path.with_suffix(".part.exr"))
    bpy.ops.render.render(write_still=True, scene=scene.name)
    os.replace(path.with_suffix(".part.exr"), path)


def _about_face(scene, mask: Path) -> None:
    """Set the scene to render the rectangle about the face alone."""
    import bpy

    image = bpy.data.images.load(str(mask), check_existing=True)
    # rows from below, as the border's
    red = np.array(image.pixels[:]).reshape(image.size[1], image.size[0], image.channels)[..., 0] > 0.5
    rows, columns = np.flatnonzero(red.any(1)), np.flatnonzero(red.any(0))
    render, margin = scene.render, MARGIN * len(red)
    render.use_border, render.use_crop_to_border = True, False
    render.border_min_x = (columns[0] - margin) / red.shape[1]
    render.border_max_x = (columns[-1] + margin) / red.shape[1]
    render.border_min_y, render.border_max_y = (rows[0] - margin) / red.shape[0], (rows[-1] + margin) / red.shape[0]


def _render_mask(obj, scene, mask: str, path: Path) -> None:
    """Render the head in a material that shines as a picture says, then give its own back."""
    import bpy

    material = bpy.data.materials.new("mask")
    if material.node_tree is None:  # before Blender 5
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    image, emission, output = (
        nodes.new(kind) for kind in ("ShaderNodeTexImage", "ShaderNodeEmission", "ShaderNodeOutputMaterial")
    )
    image.image = bpy.data.images.load(mask)
    image.image.colorspace_settings.name = "Non-Color"
    links.new(image.outputs["Color"], emission.inputs["Color"])
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    own, obj.data.materials[0] = obj.data.materials[0], material
    scene.cycles.use_denoising, scene.render.use_border, scene.world = False, False, None
    _render(scene, path, 0)
    obj.data.materials[0] = own


if __name__ == "__main__":
    main()
