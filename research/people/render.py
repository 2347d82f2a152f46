# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of a subject, path-traced by Cycles: python -m research.people.render JOB.json.

The only file of research/people that imports bpy; a process of its own. The job (rendering.py) names meshes (.npz) with
their materials, strands (.npz), the light, the cameras and the head's place in each frame. Existing frames are not
rendered again.
"""

from __future__ import annotations

import json
import math
import os
import sys
from pathlib import Path

import numpy as np

from core.geometry.meshes import read_obj

from .blender_module import without_numpy_1

with without_numpy_1():
    import bpy
    from mathutils import Matrix, Vector

GLOSS = {"skin": (0.5, None), "eyes": (0.06, 0.5), "cloth": (0.9, 0.2), "hair": (0.45, 0.35)}
"""Roughness and Specular IOR Level; the skin has a map of its own."""


def main() -> None:
    job = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    _apply_settings(scene, job)
    body = _link("head", None)
    for name, part in job["meshes"].items():
        _add_part(name, part).parent = body
    for path in job["strands"]:
        _add_strands(Path(path)).parent = body
    if job["leaves"]:
        _add_leaves(Path(job["leaves"]))
    _add_lights(scene, job)
    if job["room"]:
        _add_room(job["seed"])
    if job["torso"]:
        _add_torso(job["seed"])
    _render_frames(scene, _add_camera(scene, job), body, job)


def _apply_settings(scene: bpy.types.Scene, job: dict) -> None:
    scene.render.engine = 'CYCLES'
    scene.cycles.samples = job["samples"]
    scene.cycles.use_denoising, scene.cycles.denoising_quality, scene.cycles.denoising_prefilter = True, 'FAST', 'FAST'
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 2
    scene.cycles.glossy_bounces = 1
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.seed = job["seed"] % 65536
    scene.cycles_curves.shape = 'RIBBONS'
    scene.render.resolution_x, scene.render.resolution_y = job["width"], job["height"]
    scene.render.resolution_percentage = 100
    # an EXR holds linear light
    scene.render.image_settings.file_format = 'OPEN_EXR' if job["suffix"] == ".exr" else 'PNG'
    scene.render.use_persistent_data = True
    scene.view_settings.view_transform = 'Standard'


def _render_frames(scene: bpy.types.Scene, camera: bpy.types.Object, body: bpy.types.Object, job: dict) -> None:
    for number in job["frames"]:
        path = Path(job["out"]) / f"{number:05d}{job['suffix']}"
        if path.exists():
            continue
        body.matrix_world, camera.matrix_world = Matrix(job["poses"][number]), Matrix(job["cameras"][number])
        temporary = path.with_suffix(f".part{job['suffix']}")
        scene.render.filepath = str(temporary)
        bpy.ops.render.render(write_still=True)
        os.replace(temporary, path)


def _link(name: str, data: bpy.types.ID | None) -> bpy.types.Object:
    """Add an object to the scene."""
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def _add_camera(scene: bpy.types.Scene, job: dict) -> bpy.types.Object:
    """Add the camera, and the flash that goes with it."""
    scene.camera = camera = _link("camera", bpy.data.cameras.new("camera"))
    camera.data.sensor_fit = 'VERTICAL'
    camera.data.sensor_height = 24
    camera.data.lens = job["focal_px"] * 24 / job["height"]
    camera.data.clip_start = 0.05
    if job["flash"]:
        lamp = bpy.data.lights.new("flash", 'POINT')
        lamp.energy, lamp.shadow_soft_size = job["flash"], 0.004
        _link("flash", lamp).parent = camera
    return camera


def _add_part(name: str, part: dict) -> bpy.types.Object:
    """Add a mesh with UVs at its corners and the material of its kind."""
    with np.load(part["mesh"], allow_pickle=False) as stored:
        vertices, faces, uv = stored["vertices"], stored["faces"], stored["uv"]
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices.tolist(), [], faces.tolist())
    data.uv_layers.new(name="UVMap").data.foreach_set("uv", uv.astype(np.float32).ravel())
    data.shade_smooth()
    data.materials.append(_textured(name, part))
    return _link(name, data)


def _textured(name: str, part: dict) -> bpy.types.Material:
    """Make a part's material, without subsurface scattering: albedo means the same in the picture and in the truth."""
    material, nodes, links, shader = _principled(name, *GLOSS[part["kind"]])

    def texture(path: str, space: str) -> bpy.types.NodeSocket:
        node = nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images.load(path)
        node.image.colorspace_settings.name = space
        return node.outputs["Color"]

    links.new(texture(part["albedo"], "sRGB"), shader.inputs["Base Color"])
    if part["kind"] == "skin":
        links.new(texture(part["specular"], "Non-Color"), shader.inputs["Specular IOR Level"])
        normal = nodes.new("ShaderNodeNormalMap")
        normal.uv_map = "UVMap"
        links.new(texture(part["normal"], "Non-Color"), normal.inputs["Color"])
        links.new(normal.outputs["Normal"], shader.inputs["Normal"])
    return material


def _add_strands(path: Path) -> bpy.types.Object:
    """Add hairs as curves with their own radius and colour."""
    with np.load(path, allow_pickle=False) as stored:
        points, radius, colour = stored["points"], stored["radius"], stored["colour"]
    curves = bpy.data.hair_curves.new(path.stem)
    curves.add_curves([points.shape[1]] * len(points))
    curves.position_data.foreach_set("vector", points.astype(np.float32).ravel())
    curves.attributes.new("radius", 'FLOAT', 'POINT').data.foreach_set("value", radius.astype(np.float32).ravel())
    tint = np.concatenate([colour, np.ones((len(colour), 1))], 1)
    curves.attributes.new("tint", 'FLOAT_COLOR', 'CURVE').data.foreach_set("color", tint.astype(np.float32).ravel())
    material, nodes, links, shader = _principled("hair", *GLOSS["hair"])
    own = nodes.new("ShaderNodeAttribute")
    own.attribute_name = "tint"
    links.new(own.outputs["Color"], shader.inputs["Base Color"])
    curves.materials.append(material)
    return _link(path.stem, curves)


def _add_leaves(path: Path) -> None:
    """Add the leaves, which are nearer than the camera and unseen by it."""
    mesh, data = read_obj(path), bpy.data.meshes.new("leaves")
    data.from_pydata(mesh.vertices.tolist(), [], mesh.faces.tolist())
    material, _, _, shader = _principled("leaves", 0.8)
    shader.inputs["Base Color"].default_value = (0.05, 0.13, 0.03, 1)
    data.materials.append(material)
    _link("leaves", data).visible_camera = False


def _patterned(name: str, rng: np.random.Generator, scale: float) -> bpy.types.Material:
    """Mix two colours by a random texture: corners and blobs for structure from motion."""
    material, nodes, links, shader = _principled(name, 0.8)
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
    return material


def _principled(name: str, roughness: float, specular: float | None = None) -> tuple:
    """Make a material; return it, its nodes and links, and its Principled BSDF."""
    material = bpy.data.materials.new(name)
    tree = _tree(material)
    shader = tree.nodes["Principled BSDF"]
    shader.inputs["Roughness"].default_value = roughness
    if specular is not None:
        shader.inputs["Specular IOR Level"].default_value = specular
    return material, tree.nodes, tree.links, shader


def _tree(block: bpy.types.Material | bpy.types.World) -> bpy.types.NodeTree:
    """Return the nodes of a new material or world, which in Blender 5 has them from its start."""
    if block.node_tree is None:
        block.use_nodes = True
    return block.node_tree


def _add_lights(scene: bpy.types.Scene, job: dict) -> None:
    if job["sun"]:
        sun = bpy.data.lights.new("sun", 'SUN')
        sun.energy, sun.angle, sun.color = job["sun"]["strength"], job["sun"]["angle"], job["sun"]["colour"]
        _hang(sun, Vector(job["sun"]["direction"]), Vector())
    for lamp in job["lamps"]:
        area = bpy.data.lights.new("lamp", 'AREA')
        area.energy, area.size, area.color = lamp["power"], lamp["size"], lamp["colour"]
        _hang(area, Vector(lamp["position"]), Vector(lamp["position"]))
    scene.world = bpy.data.worlds.new("sky")
    tree = _tree(scene.world)
    colour = tree.nodes["Background"].inputs["Color"]
    if isinstance(job["sky"], str):
        panorama = tree.nodes.new("ShaderNodeTexEnvironment")
        panorama.image = bpy.data.images.load(job["sky"])
        tree.links.new(panorama.outputs["Color"], colour)
    else:
        colour.default_value = (*job["sky"], 1)


def _hang(light: bpy.types.Light, towards: Vector, position: Vector) -> None:
    """Add a light in the direction `towards` of the head; it shines along its -z."""
    thing = _link(light.name, light)
    thing.rotation_euler, thing.location = towards.to_track_quat('Z', 'Y').to_euler(), position


def _add_room(seed: int) -> None:
    """Add boxes of all sizes around and behind the head, and a floor, all patterned."""
    rng = np.random.default_rng([seed, 23])
    materials = [_patterned(f"pattern{k}", rng, rng.uniform(8, 40)) for k in range(14)]
    for k in range(90):
        azimuth, radius = np.radians(rng.uniform(-205, 25)) + math.pi, rng.uniform(0.8, 2.4)
        position = (radius * math.cos(azimuth), radius * math.sin(azimuth), rng.uniform(-1.0, 1.0))
        bpy.ops.mesh.primitive_cube_add(size=1, location=position, rotation=rng.uniform(-0.6, 0.6, 3))
        bpy.context.object.scale = rng.uniform(0.08, 0.45, 3) * radius / 1.5
        bpy.context.object.data.materials.append(materials[k % len(materials)])
    bpy.ops.mesh.primitive_plane_add(size=12, location=(0, 0, -1.2))
    bpy.context.object.data.materials.append(_patterned("floor", rng, 6))


def _add_torso(seed: int) -> None:
    """Add a shirt of sorts: an ellipsoid under the neck."""
    rng = np.random.default_rng([seed, 24])
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, location=(0, 0.07, -0.34))
    bpy.context.object.scale = (0.21, 0.13, 0.19)
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(_patterned("shirt", rng, 90))


if __name__ == "__main__":
    main()
