# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines of text as pictures, in Blender's own font, by a small render of text objects: that works without a window, in every Blender."""

from pathlib import Path

import bpy
import numpy as np

FONT = 0.52
"""Size of the letters as a share of a line's height"""


def draw(lines: list[list[str]], width: int, height: int, folder: Path) -> list[np.ndarray]:
    """Each line's words, each in the middle of its share of the width: how white [height, width, 1] is, rows from the bottom. `folder` is for a picture
    on the way, which goes again."""
    scene = bpy.data.scenes.new("WildCap Captions")
    made = []
    try:
        material = _white()
        made.append((bpy.data.materials, material))
        for row, words in enumerate(lines):
            for i, word in enumerate(words):
                text = bpy.data.curves.new("WildCap Caption", 'FONT')
                made.append((bpy.data.curves, text))
                text.body, text.size, text.align_x, text.align_y = word, FONT, 'CENTER', 'CENTER'
                text.materials.append(material)
                obj = bpy.data.objects.new(text.name, text)
                obj.location = ((i + 0.5) / len(words) * width / height, len(lines) - row - 0.5, 0.0)
                scene.collection.objects.link(obj)
        camera = bpy.data.cameras.new("WildCap Captions")
        made.append((bpy.data.cameras, camera))
        camera.type, camera.ortho_scale = 'ORTHO', max(width / height, len(lines))
        scene.camera = bpy.data.objects.new(camera.name, camera)
        scene.camera.location = (width / height / 2, len(lines) / 2, 1.0)
        scene.collection.objects.link(scene.camera)
        shown = _render(scene, width, height * len(lines), folder / ".captions.png")
    finally:
        for kind, thing in made:
            kind.remove(thing)
        bpy.data.scenes.remove(scene)
    return list(shown.reshape(len(lines), height, width, 1)[::-1])


def _white() -> bpy.types.Material:
    material = bpy.data.materials.new("WildCap Caption")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    light, output = nodes.new('ShaderNodeEmission'), nodes.new('ShaderNodeOutputMaterial')
    light.inputs["Color"].default_value = (1, 1, 1, 1)
    material.node_tree.links.new(light.outputs["Emission"], output.inputs["Surface"])
    return material


def _render(scene, width: int, height: int, path: Path) -> np.ndarray:
    """How much of each pixel letters cover, [height, width], rows from the bottom."""
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = 'CYCLES', 24, False, 0
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
    scene.render.film_transparent, scene.render.use_file_extension = True, False
    scene.render.image_settings.file_format, scene.render.image_settings.color_mode = 'PNG', 'RGBA'
    scene.render.filepath = str(path)
    try:
        bpy.ops.render.render(write_still=True, scene=scene.name)
        image = bpy.data.images.load(str(path))
        pixels = np.empty(4 * width * height, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
    finally:
        path.unlink(missing_ok=True)
    return pixels.reshape(height, width, 4)[..., 3]
