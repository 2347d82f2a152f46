# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A flat patch of skin for the tests of the material: a capture whose head is a square, lights, and a camera that gives
linear pictures."""

import json
import math

import bpy
import numpy as np
from mathutils import Vector

from tests import standin
from tests.recorded import make_entry


def make(root):
    """A capture, open, whose head is a flat square of 2 m that faces -Y, V up, and whose specular map has a mean of 0.4
    on cheeks and forehead."""
    standin.make(root)
    root.joinpath("head.obj").write_text(
        "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n", encoding="ascii"
    )
    upscaled = make_entry(figures={"specular_mean": 0.4})
    record = {"format": 2, "source": "", "stages": {"upscale": upscaled}}
    (root / "capture.json").write_text(json.dumps(record), encoding="utf-8")
    bpy.ops.wildcap.open_capture(directory=str(root))
    return root


def paint(root, name, pixels):
    bytes_of = [[tuple(int(round(255 * c)) for c in pixel) for pixel in row] for row in pixels]
    (root / "maps" / name).write_bytes(standin.png(bytes_of))


def assembled():
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    return bpy.context.view_layer.objects.active.active_material


def sockets(material):
    return material.node_tree.nodes["WildCap Skin"].inputs


def seen(path, elevation: float = 0.0, side: int = 8, samples: int = 16, width: float = 0.5) -> np.ndarray:
    """The scene's linear picture [side, side, 3] by an orthographic camera that looks at the origin from `elevation`
    degrees above -Y."""
    scene = bpy.context.scene
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("eye", bpy.data.cameras.new("eye"))
        scene.collection.objects.link(scene.camera)
    camera, angle = scene.camera, math.radians(elevation)
    camera.data.type, camera.data.ortho_scale = 'ORTHO', width
    camera.location, camera.rotation_euler = (0, -5 * math.cos(angle), 5 * math.sin(angle)), (math.pi / 2 - angle, 0, 0)
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = 'CYCLES', samples, False
    scene.render.resolution_x = scene.render.resolution_y = side
    scene.render.image_settings.file_format, scene.render.use_file_extension = 'OPEN_EXR', False
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.is_data = True
    picture = np.array(image.pixels[:]).reshape(side, side, 4)[..., :3]
    bpy.data.images.remove(image)
    return picture


def white_world(strength: float = 1.0):
    world = bpy.data.worlds.new("white")
    if world.node_tree is None:  # before Blender 5
        world.use_nodes = True
    background = next(n for n in world.node_tree.nodes if n.type == 'BACKGROUND')
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = (1, 1, 1, 1), strength
    bpy.context.scene.world = world


def lamp(direction, strength: float = 3.0):
    data = bpy.data.lights.new("sun", 'SUN')
    data.energy, data.angle = strength, 0.02
    obj = bpy.data.objects.new("sun", data)
    obj.rotation_euler = Vector(direction).to_track_quat('Z', 'Y').to_euler()
    bpy.context.scene.collection.objects.link(obj)


def height_map(root, metres: float) -> None:
    (root / "delivery").mkdir()
    image = bpy.data.images.new("height", 4, 4, float_buffer=True, is_data=True)
    image.pixels.foreach_set(np.full(64, metres, np.float32))
    image.file_format, image.filepath_raw = 'OPEN_EXR', str(root / "delivery" / "displacement.exr")
    image.save()
    bpy.data.images.remove(image)
