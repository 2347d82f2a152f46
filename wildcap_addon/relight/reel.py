# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several pictures in one render, which Esc stops as it does any of Blender's: each frame has a light of its own, or
the head or the light turns.

Every frame has its key, so nothing lies in between; the head, which is the artist's object, has none of ours: where it
turns, all else turns the other way, and where it is animated and is to stand still, time goes by slowly.
"""

from math import tau

import bpy
from mathutils import Matrix

from ...core.capture.messages import Problem
from ..hdri import Hdri
from . import lights, picture, sky

SLOWEST = 64
"""Frames to one of the artist's where time is to stand still: keys that lie closer than 1/100 replace each other."""


def each_light(
    obj: bpy.types.Object, presets: tuple[str, ...], settings: picture.RenderSettings
) -> tuple[bpy.types.Scene, int]:
    """The relight scene in which the head is as it is now, and the first of the frames that have the lights `presets`
    in turn. Raises Problem before frame 0, where Blender renders no row of frames."""
    scene = settings.scene(obj, presets[0])
    first, moments = _slow_down(scene, len(presets))
    lights.clear(scene)
    frame, radius = picture.frame_of(obj)
    frame = frame @ Matrix.Rotation(settings.turn, 4, 'Z')
    for name, moment in zip(presets, moments, strict=True):
        preset = lights.preset(name)
        for lamp in lights.add_lamps(scene, preset.lamps, frame, radius):
            for at in moments:
                lamp.hide_render = at != moment
                lamp.keyframe_insert("hide_render", frame=at)
        for socket, colour in zip(sky.sockets(scene.world), sky.colours(preset.sky), strict=True):
            socket.default_value = colour
            socket.keyframe_insert("default_value", frame=moment)
    return scene, first


def _slow_down(scene: bpy.types.Scene, count: int) -> tuple[int, list[float]]:
    """Lets time go by so slowly that all which is animated is seen as it is now in each of `count` frames; the first of
    them, and the moments that they show. By a power of two, so that the first shows this very moment."""
    now, last = scene.frame_current_final, scene.bl_rna.properties["frame_end"].hard_max
    if now < 0:
        raise Problem(
            f"Frame {now:g} lies before frame 0, where Blender renders no row of pictures.",
            "Go to frame 0 or a later one, or render one light after the other.",
        )
    steps = SLOWEST
    while steps > 1 and now * steps + count > last:
        steps //= 2
    scene.render.frame_map_old, scene.render.frame_map_new = 1, steps
    first = round(now * steps)
    return first, [(first + i) / steps for i in range(count)]


def animate_turn(
    obj: bpy.types.Object, light: str | Hdri, turns: str, frames: int, settings: picture.RenderSettings
) -> bpy.types.Scene:
    """The relight scene in which the head or the light goes once around, counter-clockwise from above.

    Parameters
    ----------
    obj : the head
    light : a preset's name, or a picture of surroundings
    turns : 'HEAD' or 'LIGHT'
    frames : of the whole turn, from 1 on
    settings : of each frame
    """
    scene = settings.scene(obj, light)
    frame, _ = picture.frame_of(obj)
    rig, camera = lights.rig(scene), scene.camera
    moved = [o for o in (rig, camera if turns == 'HEAD' else None) if o is not None]
    start = {o: o.matrix_world.copy() for o in moved}
    mapping = (
        next((n for n in scene.world.node_tree.nodes if n.type == 'MAPPING'), None) if isinstance(light, Hdri) else None
    )
    first = mapping.inputs["Rotation"].default_value[2] if mapping else 0.0
    for i in range(frames):
        angle = tau * i / frames * (-1 if turns == 'HEAD' else 1)
        around = frame @ Matrix.Rotation(angle, 4, 'Z') @ frame.inverted()
        for o in moved:
            o.matrix_world = around @ start[o]
            o.keyframe_insert("location", frame=i + 1)
            o.keyframe_insert("rotation_euler", frame=i + 1)
        if mapping:
            mapping.inputs["Rotation"].default_value[2] = first - angle
            mapping.inputs["Rotation"].keyframe_insert("default_value", frame=i + 1)
    return scene


def as_film(scene: bpy.types.Scene, frames_per_second: int) -> None:
    """Frames go into one MP4 (H.264)."""
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):  # Blender 5
        settings.media_type = 'VIDEO'
    settings.file_format = 'FFMPEG'
    film = scene.render.ffmpeg
    film.format, film.codec, film.constant_rate_factor, film.audio_codec = 'MPEG4', 'H264', 'HIGH', 'NONE'
    scene.render.fps, scene.render.fps_base = frames_per_second, 1.0


def can_film() -> bool:
    """Whether this Blender was built with FFmpeg."""
    return bool(bpy.app.build_options.codec_ffmpeg)
