# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A relit picture: the head in a scene of its own with a camera and a light, rendered by Cycles to the capture's renders/.

The artist's scene (camera, world, lights, render settings) is not touched.
"""

import os
from math import tan
from pathlib import Path

import bpy
from mathutils import Matrix, Vector

from ...core.capture import storage_problem
from .. import colours
from ..hdri import Hdri
from . import lights

SCENE = "WildCap Relight"
CAMERA_DIRECTION = (-0.28, -1.0, 0.05)
FOCAL_LENGTH_MM = 85.0


def set_up(obj: bpy.types.Object, light: str | Hdri, resolution: int, samples: int) -> bpy.types.Scene:
    """The relight scene with this head alone in it, framed and lit."""
    scene = bpy.data.scenes.get(SCENE) or bpy.data.scenes.new(SCENE)
    for other in [o for o in scene.collection.objects if o.type not in ('CAMERA', 'LIGHT')]:
        scene.collection.objects.unlink(other)
    scene.collection.objects.link(obj)
    frame, radius = frame_of(obj)
    lights.build(scene, light, frame, radius)
    _camera(scene, frame, radius)
    render = scene.render
    render.engine = 'CYCLES'
    render.resolution_x = render.resolution_y = resolution
    render.resolution_percentage = 100
    render.image_settings.file_format = 'PNG'
    render.image_settings.color_mode = 'RGB'
    render.use_file_extension = False
    scene.cycles.samples = samples
    scene.cycles.use_denoising = has_denoiser()
    colours.without_a_look(scene)
    return scene


def render(scene: bpy.types.Scene, path: Path, wait: bool) -> None:
    """Renders to `path`. wait=False returns at once and shows Blender's render window. Raises Problem when the folder cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{path.name}")
        temporary.touch()
    except OSError as error:
        raise storage_problem(error, path) from error
    scene.render.filepath = str(temporary)
    bpy.ops.render.render('EXEC_DEFAULT' if wait else 'INVOKE_DEFAULT', write_still=True, scene=scene.name)


def frame_of(obj) -> tuple[Matrix, float]:
    """Where the head is: a matrix without scale at its bounding box's centre, and its radius in scene units."""
    corners = [obj.matrix_world @ Vector(corner) for corner in obj.bound_box]
    centre = sum(corners, Vector()) / 8
    radius = max(abs((a - b)[axis]) for a in corners for b in corners for axis in range(3)) / 2
    return Matrix.Translation(centre) @ obj.matrix_world.to_quaternion().to_matrix().to_4x4(), radius


def has_denoiser() -> bool:
    """Whether this Blender was built with OpenImageDenoise; without it a render that asks for it fails."""
    try:
        import _cycles
    except ImportError:
        return False
    return bool(getattr(_cycles, "with_openimagedenoise", False))


def _camera(scene, frame: Matrix, radius: float) -> None:
    camera = scene.camera
    if camera is None:
        data = bpy.data.cameras.new("WildCap Camera")
        camera = bpy.data.objects.new(data.name, data)
        scene.collection.objects.link(camera)
        scene.camera = camera
    camera.data.lens = FOCAL_LENGTH_MM
    direction = Vector(CAMERA_DIRECTION).normalized()
    distance = radius * 1.12 / tan(camera.data.angle / 2)
    camera.matrix_world = frame @ Matrix.Translation(direction * (distance + radius * 0.2)) @ direction.to_track_quat('Z', 'Y').to_matrix().to_4x4()
    camera.data.clip_start, camera.data.clip_end = distance * 0.01, distance * 100


@bpy.app.handlers.persistent
def name_when_complete(scene, *_):
    """Gives the finished picture its name: a file that exists under it is complete."""
    path = Path(scene.render.filepath)
    if scene.name == SCENE and path.name.startswith(".") and path.is_file():
        os.replace(path, path.with_name(path.name[1:]))


def register():
    bpy.app.handlers.render_write.append(name_when_complete)


def unregister():
    bpy.app.handlers.render_write.remove(name_when_complete)
