# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras of the scene as JSON for the setting `cameras.import_from`.

core/stages/cameras/importers/blender_cameras.py documents the layout. Not a button:
`write_cameras(bpy.context.scene, "cameras.json")` from Blender's console or a script.
"""

from pathlib import Path

import bpy

from ...core.capture.files import write_json


def write_cameras(scene: bpy.types.Scene, path: str) -> int:
    """Write the scene's cameras, and return how many.

    Each has its object's name, which must be its photograph's; a single animated camera instead has an entry per frame
    of the scene, numbered from 0 like the video's. Pictures have the scene's resolution and square pixels.
    """
    width, height = (
        round(side * scene.render.resolution_percentage / 100)
        for side in (scene.render.resolution_x, scene.render.resolution_y)
    )
    objects = [thing for thing in scene.objects if thing.type == 'CAMERA' and thing.data.type == 'PERSP']
    before, entries = scene.frame_current, []
    if len(objects) == 1 and objects[0].animation_data is not None and objects[0].animation_data.action is not None:
        for number in range(scene.frame_start, scene.frame_end + 1):
            scene.frame_set(number)
            entries.append({"frame": number - scene.frame_start, **_entry(objects[0], width, height)})
        scene.frame_set(before)
    else:
        bpy.context.view_layer.update()
        entries = [{"name": thing.name, **_entry(thing, width, height)} for thing in objects]
    write_json(Path(bpy.path.abspath(path)), {"width": width, "height": height, "cameras": entries})
    return len(entries)


def _entry(camera: bpy.types.Object, width: int, height: int) -> dict:
    """Return a camera's matrix, focal length and principal point.

    With an automatic fit the sensor's width belongs to the picture's longer side; the lens's shift is a share of the
    same side.
    """
    lens = camera.data
    across = lens.sensor_fit == 'HORIZONTAL' or (lens.sensor_fit == 'AUTO' and width >= height)
    side = width if across else height
    focal = lens.lens / (lens.sensor_height if lens.sensor_fit == 'VERTICAL' else lens.sensor_width) * side
    return {
        "matrix_world": [list(row) for row in camera.matrix_world.normalized()],
        "focal_px": focal,
        "centre_px": [width / 2 - lens.shift_x * side, height / 2 + lens.shift_y * side],
    }
