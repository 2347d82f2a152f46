# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of a person, path-traced by Cycles, in a process of its own, like research/people/render.py:

    python -m research.people.lifelike.render JOB.json

The job, written by filmed.py, names meshes (.npz) with their materials, strands (.npz), the light, the cameras and
where the head is in each frame.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from core.geometry.meshes import read_obj

from ..blender_module import without_numpy_1
from ..render import add_camera, add_lights, add_mesh, add_room, apply_settings, plain, principled, render_frames

with without_numpy_1():
    import bpy
    from mathutils import Matrix

GLOSS = {"skin": None, "eyes": (0.06, 0.5), "cloth": (0.9, 0.2)}
"""Roughness and Specular IOR Level; the skin has maps of its own."""


def main() -> None:
    job = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    scene, body = build(job)

    def place(number: int) -> None:
        body.matrix_world = Matrix(job["poses"][number])

    render_frames(scene, add_camera(scene, job), job, place)


def build(job: dict) -> tuple[bpy.types.Scene, bpy.types.Object]:
    """The person, the light and the room; and what the head hangs on."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    apply_settings(scene, job)
    scene.cycles_curves.shape = 'RIBBONS'
    body = bpy.data.objects.new("head", None)
    scene.collection.objects.link(body)
    for name, mesh in job["meshes"].items():
        _add(name, mesh).parent = body
    for path in job["strands"]:
        _add_strands(Path(path)).parent = body
    if job["leaves"]:
        add_mesh(read_obj(Path(job["leaves"])), "leaves", plain("leaves", (0.05, 0.13, 0.03))).visible_camera = False
    add_lights(scene, job)
    if job["room"]:
        add_room(job["seed"])
    return scene, body


def _add(name: str, mesh_job: dict) -> bpy.types.Object:
    """A mesh with UVs at its corners and the material that its kind says."""
    with np.load(mesh_job["mesh"], allow_pickle=False) as stored:
        vertices, faces, uv = stored["vertices"], stored["faces"], stored["uv"]
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices.tolist(), [], faces.tolist())
    data.uv_layers.new(name="UVMap").data.foreach_set("uv", uv.astype(np.float32).ravel())
    data.shade_smooth()
    data.materials.append(_material(name, mesh_job))
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def _material(name: str, mesh_job: dict) -> bpy.types.Material:
    material, nodes, links, shader = principled(name)

    def texture(path: str, space: str) -> bpy.types.NodeSocket:
        node = nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images.load(path)
        node.image.colorspace_settings.name = space
        return node.outputs["Color"]

    links.new(texture(mesh_job["albedo"], "sRGB"), shader.inputs["Base Color"])
    if mesh_job["kind"] == "skin":
        links.new(texture(mesh_job["specular"], "Non-Color"), shader.inputs["Specular IOR Level"])
        normal = nodes.new("ShaderNodeNormalMap")
        normal.uv_map = "UVMap"
        links.new(texture(mesh_job["normal"], "Non-Color"), normal.inputs["Color"])
        links.new(normal.outputs["Normal"], shader.inputs["Normal"])
        shader.inputs["Roughness"].default_value = 0.5
    else:
        shader.inputs["Roughness"].default_value, shader.inputs["Specular IOR Level"].default_value = GLOSS[
            mesh_job["kind"]
        ]
    return material


def _add_strands(path: Path) -> bpy.types.Object:
    """Hairs as curves with their own radius and colour."""
    with np.load(path, allow_pickle=False) as stored:
        points, radius, colour = stored["points"], stored["radius"], stored["colour"]
    curves = bpy.data.hair_curves.new(path.stem)
    curves.add_curves([points.shape[1]] * len(points))
    curves.position_data.foreach_set("vector", points.astype(np.float32).ravel())
    curves.attributes.new("radius", 'FLOAT', 'POINT').data.foreach_set("value", radius.astype(np.float32).ravel())
    tint = np.concatenate([colour, np.ones((len(colour), 1))], 1)
    curves.attributes.new("tint", 'FLOAT_COLOR', 'CURVE').data.foreach_set("color", tint.astype(np.float32).ravel())
    curves.materials.append(_hair())
    thing = bpy.data.objects.new(path.stem, curves)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def _hair() -> bpy.types.Material:
    if "hair" in bpy.data.materials:
        return bpy.data.materials["hair"]
    material, nodes, links, shader = principled("hair")
    tint = nodes.new("ShaderNodeAttribute")
    tint.attribute_name = "tint"
    links.new(tint.outputs["Color"], shader.inputs["Base Color"])
    shader.inputs["Roughness"].default_value, shader.inputs["Specular IOR Level"].default_value = 0.45, 0.35
    return material


if __name__ == "__main__":
    main()
