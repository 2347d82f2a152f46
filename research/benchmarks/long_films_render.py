# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Many frames of a person at a low price, in a process of its own: `python -m research.benchmarks.long_films_render
JOB.json`, a job of research/people/lifelike/filmed.py.

The light is traced once, for each vertex of the person; then everything shines by itself, and a frame needs a few rays
to the first thing they meet and no denoising. Geometry and parallax are true; what changes with the viewer, gloss, is
missing, and the room throws no shadows.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from core.geometry import meshes, raster
from core.imaging import images

from ..people.blender_module import without_numpy_1
from ..people.lifelike.render import build
from ..people.render import add_camera, render_frames

with without_numpy_1():
    import bpy

PERSON = ("skin", "left_eye", "right_eye", "shirt")
RAYS, SUN_RAYS = 96, 24
"""From each vertex to the sky, and to the sun's disc."""
LIFT_M = 5e-4
CROWN = (0.0, 0.05, 0.0)
"""About the middle of the head, from where its hair's shading is told."""


def main() -> None:
    job = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    scene, _ = build(job)
    parts = {name: scene.objects[name] for name in PERSON if name in scene.objects}
    lights = traced(parts, job["sun"], images.read_linear(Path(job["sky"])))
    for name, thing in parts.items():
        attribute = thing.data.color_attributes.new("light", 'FLOAT_COLOR', 'POINT')
        attribute.data.foreach_set("color", np.insert(lights[name], 3, 1, 1).astype(np.float32).ravel())
        tree = thing.data.materials[0].node_tree
        light = tree.nodes.new("ShaderNodeAttribute")
        light.attribute_name = "light"
        _emit(tree, _product(tree, _colour(tree), light.outputs["Color"]))
    for material in {
        thing.data.materials[0]
        for thing in scene.objects
        if thing.type in ('MESH', 'CURVES') and thing.name not in parts
    }:
        shine(material, job["sun"]["direction"], np.median(lights["skin"], axis=0).tolist())
    for thing in [
        thing for thing in scene.objects if thing.type == 'LIGHT' or thing.type == 'MESH' and not thing.visible_camera
    ]:
        bpy.data.objects.remove(thing)
    scene.cycles.use_denoising, scene.cycles.max_bounces = False, 0
    scene.render.image_settings.color_depth, scene.render.image_settings.exr_codec = '16', 'ZIPS'
    render_frames(scene, add_camera(scene, job), job)


def traced(objects: dict[str, bpy.types.Object], sun: dict, sky: np.ndarray) -> dict[str, np.ndarray]:
    """What the albedo of each vertex is to be multiplied with, linear [V, 3] by part: the sky [H, W, 3] and the sun
    past the person."""
    whole = meshes.joined([_mesh(thing) for thing in objects.values()])
    caster, points, normals = raster.RayCaster(whole), whole.vertices, meshes.vertex_normals(whole)
    rng, light, start = np.random.default_rng(0), np.zeros((len(points), 3)), points + LIFT_M * normals
    for _ in range(RAYS):  # directions by the cosine, so that each counts alike
        towards = _unit(normals + 0.999 * _unit(rng.normal(size=points.shape)))
        free = ~caster.blocked(start, towards)
        row = (np.arccos(np.clip(towards[:, 2], -1, 1)) / np.pi * len(sky)).astype(int).clip(0, len(sky) - 1)
        turn = 0.5 - np.arctan2(towards[:, 1], towards[:, 0]) / (2 * np.pi)
        column = (turn * sky.shape[1]).astype(int) % sky.shape[1]
        light += free[:, None] * sky[row, column] / RAYS
    middle = np.array(sun["direction"])
    for _ in range(SUN_RAYS):
        towards = _unit(
            middle + np.tan(sun["angle"] / 2) * np.sqrt(rng.random()) * _unit(np.cross(middle, rng.normal(size=3)))
        )
        free = ~caster.blocked(start, np.repeat(towards[None], len(points), 0))
        light += (
            (free * np.clip(normals @ towards, 0, 1))[:, None]
            * np.array(sun["colour"])
            * sun["strength"]
            / np.pi
            / SUN_RAYS
        )
    ends = np.cumsum([len(thing.data.vertices) for thing in objects.values()])
    return dict(zip(objects, np.split(light, ends[:-1]), strict=True))


def _mesh(obj: bpy.types.Object) -> meshes.Mesh:
    """An object's triangles; it stands where it was made."""
    vertices = np.zeros(3 * len(obj.data.vertices))
    obj.data.vertices.foreach_get("co", vertices)
    return meshes.Mesh(vertices.reshape(-1, 3), np.array([polygon.vertices[:] for polygon in obj.data.polygons]))


def _unit(directions: np.ndarray) -> np.ndarray:
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def shine(material: bpy.types.Material, sun: Sequence[float], light: Sequence[float]) -> None:
    """Lit without shadows, about as brightly as the skin is in its median, and more towards the sun. Hairs are lit as
    the head that they stand on."""
    tree = material.node_tree
    place = tree.nodes.new("ShaderNodeNewGeometry")
    normal = place.outputs["Normal"]
    if material.name == "hair":
        normal = _vector(tree, 'NORMALIZE', _vector(tree, 'SUBTRACT', place.outputs["Position"], CROWN))
    share = tree.nodes.new("ShaderNodeMath")
    share.operation, share.use_clamp = 'MULTIPLY_ADD', True
    tree.links.new(_vector(tree, 'DOT_PRODUCT', normal, sun, 1), share.inputs[0])
    share.inputs[1].default_value, share.inputs[2].default_value = 0.5, 0.55
    _emit(tree, _product(tree, _vector(tree, 'MULTIPLY', _colour(tree), light), share.outputs[0]))


def _colour(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    base = tree.nodes["Principled BSDF"].inputs["Base Color"]
    if base.is_linked:
        return base.links[0].from_socket
    node = tree.nodes.new("ShaderNodeRGB")
    node.outputs[0].default_value = base.default_value
    return node.outputs[0]


def _vector(
    tree: bpy.types.NodeTree,
    operation: str,
    first: bpy.types.NodeSocket,
    second: Sequence[float] = (0, 0, 0),
    output: int = 0,
) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    tree.links.new(first, node.inputs[0])
    node.inputs[1].default_value = second
    return node.outputs[output]


def _product(
    tree: bpy.types.NodeTree, first: bpy.types.NodeSocket, second: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = 'MULTIPLY'
    tree.links.new(first, node.inputs[0])
    tree.links.new(second, node.inputs[1])
    return node.outputs[0]


def _emit(tree: bpy.types.NodeTree, colour: bpy.types.NodeSocket) -> None:
    """A material that shines with a colour, and does nothing else."""
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(colour, emission.inputs["Color"])
    output = next(node for node in tree.nodes if node.type == 'OUTPUT_MATERIAL')
    tree.links.new(emission.outputs[0], output.inputs["Surface"])


if __name__ == "__main__":
    main()
