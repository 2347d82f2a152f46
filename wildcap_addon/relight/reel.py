# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several pictures in one render, which Esc stops: each frame has a light of its own, or the head or the light turns.

Every frame has its key, so that nothing is interpolated. The head is the artist's object and gets no keys: for it to
turn, all else turns the other way; for an animated one to stand still, time is slowed down.
"""

from math import tau

import bpy
from mathutils import Matrix

from ...core.capture.messages import Problem
from ..hdri import Hdri
from . import lights, picture, sky

SLOWEST = 64
"""Frames per frame of the artist's when time stands still: keys closer than 1/100 replace each other."""


def each_light(
    obj: bpy.types.Object, presets: tuple[str, ...], settings: picture.RenderSettings
) -> tuple[bpy.types.Scene, int]:
    """Return the relight scene with the head as it is now, and the first of the frames that have a preset each.

    Raises Problem before frame 0, where Blender renders no animation.
    """
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
    """Slow time down so that `count` frames show everything as it is now; return the first and the times of all.

    By a power of two, so that the first shows exactly the present time.
    """
    now, last = scene.frame_current_final, scene.bl_rna.properties["frame_end"].hard_max
    if now < 0:
        raise Problem(
            f"Frame {now:g} is before frame 0, where Blender cannot render several pictures at once.",
            "Go to frame 0 or a later one, or render the lights one by one.",
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
    """Return the relight scene in which 'HEAD' or 'LIGHT' turns once counter-clockwise from above, from frame 1 on."""
    scene = settings.scene(obj, light)
    frame, _ = picture.frame_of(obj)
    rig, camera = lights.rig(scene), scene.camera
    moved = [o for o in (rig, camera if turns == 'HEAD' else None) if o is not None]
    start = {o: o.matrix_world.copy() for o in moved}
    nodes = scene.world.node_tree.nodes if isinstance(light, Hdri) else ()
    mapping = next((n for n in nodes if n.type == 'MAPPING'), None)
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
    """Have the frames written to one MP4 (H.264)."""
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):  # Blender 5
        settings.media_type = 'VIDEO'
    settings.file_format = 'FFMPEG'
    film = scene.render.ffmpeg
    film.format, film.codec, film.constant_rate_factor, film.audio_codec = 'MPEG4', 'H264', 'HIGH', 'NONE'
    scene.render.fps, scene.render.fps_base = frames_per_second, 1.0


def can_film() -> bool:
    """Return whether this Blender was built with FFmpeg."""
    return bool(bpy.app.build_options.codec_ffmpeg)
