# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Relight scene: the head in a scene of its own with a camera and a light, for Cycles.

The artist's scene (camera, world, lights, render settings) stays as it is.
"""

from dataclasses import dataclass
from math import floor, tan

import bpy
from mathutils import Matrix, Vector

from .. import captures, colours
from ..data_blocks import find, stop_animation
from ..hdri import Hdri
from . import lights, output
from .output import SCENE, view_label

CAMERA_DIRECTION = (-0.28, -1.0, 0.05)
"""Direction from the head, in its axes."""
FOCAL_LENGTH_MM = 85.0
"""Focal length of a portrait lens."""


@dataclass(frozen=True)
class RenderSettings:
    resolution: int  # pixels of a side
    samples: int
    turn: float = 0.0  # of the light about the head, radians
    view: str = colours.VIEWS[0]  # view transform
    exposure: float = 0.0  # stops, of the view alone

    def scene(self, obj: bpy.types.Object, light: str | Hdri) -> bpy.types.Scene:
        """Return the relight scene with this head."""
        return set_up_scene(obj, light, self.resolution, self.samples, self.turn, self.view, self.exposure)


def set_up_scene(
    obj: bpy.types.Object,
    light: str | Hdri,
    resolution: int,
    samples: int,
    turn: float = 0.0,
    view: str = colours.VIEWS[0],
    exposure: float = 0.0,
) -> bpy.types.Scene:
    """Return the relight scene with only this head and what it wears, framed and lit by a preset or a picture.

    turn: of the light about the head, in radians, counter-clockwise from above; view, exposure: the view transform and
    its stops, which the picture's file names.
    """
    scene = find(bpy.data.scenes, SCENE) or bpy.data.scenes.new(SCENE)
    output.let_go(scene)
    for thing in (obj, *captures.worn(obj)):
        scene.collection.objects.link(thing)
    frame, radius = frame_of(obj)
    lights.build_light(scene, light, frame, radius, turn)
    _camera(scene, frame, radius)
    now, render = bpy.context.scene, scene.render
    render.frame_map_old = render.frame_map_new = 100
    moment = now.frame_current_final
    scene.frame_set(floor(moment), subframe=moment - floor(moment))  # an animated head looks as it does there
    render.engine = 'CYCLES'
    render.resolution_x = render.resolution_y = resolution
    render.resolution_percentage = 100
    render.use_lock_interface = True  # no thread draws what another changes
    scene.cycles.device = now.cycles.device  # the artist's choice; a file without one renders on the CPU
    render.threads_mode, render.threads = now.render.threads_mode, now.render.threads
    scene.cycles.samples = samples
    scene.cycles.use_denoising = has_denoiser()
    colours.show_by(scene, view, exposure)
    _label(scene)
    return scene


def _label(scene) -> None:
    """Have the frames' metadata name the view transform, and neither places nor persons."""
    render = scene.render
    for name in (p.identifier for p in render.bl_rna.properties if p.identifier.startswith("use_stamp_")):
        setattr(render, name, name == "use_stamp_note")
    render.use_stamp = False
    render.stamp_note_text = view_label(scene)


def frame_of(obj) -> tuple[Matrix, float]:
    """Return the head's place: a matrix without scale at its bounding box's centre, and its radius in scene units.

    A mirrored head keeps the direction in which it looks, with left and right exchanged.
    """
    corners = [obj.matrix_world @ Vector(corner) for corner in obj.bound_box]
    centre = sum(corners, Vector()) / 8
    radius = max(abs((a - b)[axis]) for a in corners for b in corners for axis in range(3)) / 2
    world = obj.matrix_world
    turn = world @ Matrix.Diagonal((-1, 1, 1, 1)) if world.is_negative else world
    return Matrix.Translation(centre) @ turn.to_quaternion().to_matrix().to_4x4(), radius


def has_denoiser() -> bool:
    """Return whether this Blender has OpenImageDenoise: without it a render that asks for it fails."""
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
    stop_animation(camera)
    camera.data.lens = FOCAL_LENGTH_MM
    direction = Vector(CAMERA_DIRECTION).normalized()
    distance = radius * 1.12 / tan(camera.data.angle / 2)
    place = Matrix.Translation(direction * (distance + radius * 0.2))
    camera.matrix_world = frame @ place @ direction.to_track_quat('Z', 'Y').to_matrix().to_4x4()
    camera.data.clip_start, camera.data.clip_end = distance * 0.01, distance * 100
