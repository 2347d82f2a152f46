# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of a synthetic subject, path-traced by Cycles. With people/render.py the only file of core that imports
bpy; a process of its own:

    python -m research.people.render JOB.json

The job (written by sample.py) names the head, its maps, the leaves, the sun, the sky, the cameras and the output
folder. Frames that exist are not rendered again.
"""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from core.geometry.meshes import Mesh, read_obj

from .blender_module import without_numpy_1

with without_numpy_1():
    import bpy
    from mathutils import Matrix, Vector


def main() -> None:
    job = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    apply_settings(scene, job)
    add_mesh(read_obj(Path(job["head"])), "head", _skin(job["maps"]))
    if job["leaves"]:
        # they are nearer than the camera
        add_mesh(read_obj(Path(job["leaves"])), "leaves", plain("leaves", (0.05, 0.13, 0.03))).visible_camera = False
    add_lights(scene, job)
    if job["room"]:
        add_room(job["seed"])
    _torso(job["seed"])
    camera = add_camera(scene, job)
    render_frames(scene, camera, job)


def add_camera(scene: bpy.types.Scene, job: dict) -> bpy.types.Object:
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.data.sensor_fit = 'VERTICAL'
    camera.data.sensor_height = 24
    camera.data.lens = job["focal_px"] * 24 / job["height"]
    camera.data.clip_start = 0.05
    if job["flash"]:
        lamp = bpy.data.lights.new("flash", 'POINT')
        lamp.energy, lamp.shadow_soft_size = job["flash"], 0.004
        flash = bpy.data.objects.new("flash", lamp)
        flash.parent = camera
        scene.collection.objects.link(flash)
    return camera


def render_frames(
    scene: bpy.types.Scene, camera: bpy.types.Object, job: dict, place: Callable[[int], None] = lambda number: None
) -> None:
    """Renders the job's frames that do not exist yet.

    Parameters
    ----------
    scene : with everything in it
    camera : moves to where it is in each frame
    job : what was written for it (sample.py)
    place : number of a frame -> None, puts what else moves where it is in it
    """
    for number in job["frames"]:
        path = Path(job["out"]) / f"{number:05d}{job['suffix']}"
        if path.exists():
            continue
        place(number)
        camera.matrix_world = Matrix(job["cameras"][number])
        temporary = path.with_suffix(f".part{job['suffix']}")
        scene.render.filepath = str(temporary)
        bpy.ops.render.render(write_still=True)
        os.replace(temporary, path)
        print(f"frame {number}", flush=True)


def apply_settings(scene: bpy.types.Scene, job: dict) -> None:
    scene.render.engine = 'CYCLES'
    scene.cycles.samples = job["samples"]
    scene.cycles.use_denoising, scene.cycles.denoising_quality, scene.cycles.denoising_prefilter = True, 'FAST', 'FAST'
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 2
    scene.cycles.glossy_bounces = 1
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.seed = job["seed"] % 65536
    scene.render.resolution_x, scene.render.resolution_y = job["width"], job["height"]
    scene.render.resolution_percentage = 100
    # an EXR holds linear light
    scene.render.image_settings.file_format = 'OPEN_EXR' if job["suffix"] == ".exr" else 'PNG'
    scene.render.use_persistent_data = True
    scene.view_settings.view_transform = 'Standard'


def add_mesh(mesh: Mesh, name: str, material: bpy.types.Material) -> bpy.types.Object:
    data = bpy.data.meshes.new(name)
    data.from_pydata(mesh.vertices.tolist(), [], mesh.faces.tolist())
    if mesh.uvs is not None:
        layer = data.uv_layers.new(name="UVMap")
        layer.data.foreach_set("uv", mesh.uvs[mesh.face_uvs].astype(np.float32).ravel())
        data.shade_smooth()
    data.materials.append(material)
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def _skin(maps: dict) -> bpy.types.Material:
    """Albedo, gloss and relief as the truth says; no subsurface scattering, so that albedo means the same in the
    picture and in the truth."""
    material, nodes, links, shader = principled("skin")

    def texture(name: str, space: str) -> bpy.types.Node:
        node = nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images.load(maps[name])
        node.image.colorspace_settings.name = space
        return node

    links.new(texture("diffuse", "sRGB").outputs["Color"], shader.inputs["Base Color"])
    links.new(texture("specular", "Non-Color").outputs["Color"], shader.inputs["Specular IOR Level"])
    normal = nodes.new("ShaderNodeNormalMap")
    normal.uv_map = "UVMap"
    links.new(texture("normal", "Non-Color").outputs["Color"], normal.inputs["Color"])
    links.new(normal.outputs["Normal"], shader.inputs["Normal"])
    shader.inputs["Roughness"].default_value = 0.5
    return material


def plain(name: str, colour: tuple[float, float, float]) -> bpy.types.Material:
    material, _, _, shader = principled(name)
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = 0.8
    return material


def patterned(name: str, rng: np.random.Generator, scale: float) -> bpy.types.Material:
    """Two colours mixed by a random texture: corners and blobs for structure from motion."""
    material, nodes, links, shader = principled(name)
    # neither repeats: what repeats misleads the matching of features
    kind = rng.choice(["ShaderNodeTexVoronoi", "ShaderNodeTexNoise"])
    texture, ramp, place = nodes.new(kind), nodes.new("ShaderNodeValToRGB"), nodes.new("ShaderNodeTexCoord")
    links.new(place.outputs["Object"], texture.inputs["Vector"])
    texture.inputs["Scale"].default_value = scale
    if kind == "ShaderNodeTexNoise":
        texture.inputs["Detail"].default_value = 1
    links.new(texture.outputs[0], ramp.inputs["Fac"])
    ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[1].position = 0.42, 0.58
    for element in ramp.color_ramp.elements:
        element.color = (*(rng.uniform(0.02, 0.55) * rng.uniform(0.5, 1, 3)), 1)
    links.new(ramp.outputs["Color"], shader.inputs["Base Color"])
    shader.inputs["Roughness"].default_value = 0.8
    return material


def principled(name: str):
    material = bpy.data.materials.new(name)
    tree = _tree(material)
    return material, tree.nodes, tree.links, tree.nodes["Principled BSDF"]


def _tree(block: bpy.types.Material | bpy.types.World) -> bpy.types.NodeTree:
    """The nodes of a new material or world, which it has from its start in Blender 5."""
    if block.node_tree is None:
        block.use_nodes = True
    return block.node_tree


def add_lights(scene: bpy.types.Scene, job: dict) -> None:
    if job["sun"]:
        sun = bpy.data.lights.new("sun", 'SUN')
        sun.energy, sun.angle, sun.color = job["sun"]["strength"], job["sun"]["angle"], job["sun"]["colour"]
        _hang(scene, sun, Vector(job["sun"]["direction"]), Vector())
    for lamp in job["lamps"]:
        area = bpy.data.lights.new("lamp", 'AREA')
        area.energy, area.size, area.color = lamp["power"], lamp["size"], lamp["colour"]
        _hang(scene, area, Vector(lamp["position"]), Vector(lamp["position"]))
    scene.world = bpy.data.worlds.new("sky")
    tree = _tree(scene.world)
    nodes = tree.nodes
    if isinstance(job["sky"], str):
        panorama = nodes.new("ShaderNodeTexEnvironment")
        panorama.image = bpy.data.images.load(job["sky"])
        tree.links.new(panorama.outputs["Color"], nodes["Background"].inputs["Color"])
    else:
        nodes["Background"].inputs["Color"].default_value = (*job["sky"], 1)


def _hang(scene: bpy.types.Scene, light: bpy.types.Light, towards: Vector, position: Vector) -> None:
    """Puts a light in the direction `towards` of the head; a lamp shines along its -z."""
    thing = bpy.data.objects.new(light.name, light)
    thing.rotation_euler, thing.location = towards.to_track_quat('Z', 'Y').to_euler(), position
    scene.collection.objects.link(thing)


def add_room(seed: int, count: int = 90) -> None:
    """Boxes of all sizes around and behind the head, and a floor, all patterned."""
    rng = np.random.default_rng([seed, 23])
    materials = [patterned(f"pattern{k}", rng, rng.uniform(8, 40)) for k in range(14)]
    for k in range(count):
        azimuth, radius = np.radians(rng.uniform(-205, 25)) + math.pi, rng.uniform(0.8, 2.4)
        position = (radius * math.cos(azimuth), radius * math.sin(azimuth), rng.uniform(-1.0, 1.0))
        bpy.ops.mesh.primitive_cube_add(size=1, location=position, rotation=rng.uniform(-0.6, 0.6, 3))
        bpy.context.object.scale = rng.uniform(0.08, 0.45, 3) * radius / 1.5
        bpy.context.object.data.materials.append(materials[k % len(materials)])
    bpy.ops.mesh.primitive_plane_add(size=12, location=(0, 0, -1.2))
    bpy.context.object.data.materials.append(patterned("floor", rng, 6))


def _torso(seed: int) -> None:
    """A shirt of sorts: an ellipsoid under the neck."""
    rng = np.random.default_rng([seed, 24])
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, location=(0, 0.07, -0.34))
    bpy.context.object.scale = (0.21, 0.13, 0.19)
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(patterned("shirt", rng, 90))


if __name__ == "__main__":
    main()
