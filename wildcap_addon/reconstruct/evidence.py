# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras, with their frames as backgrounds, and the scan, brought into the scene.

Both are children of the head, if it is there; their own coordinates are those of the capture's world (metres).
"""

import contextlib
from collections.abc import Iterable

import bpy

from ...core.capture.capture import Capture
from ...core.capture.frame_records import read_frames
from ...core.capture.messages import Problem
from ...core.capture.stages import advise_again
from .. import captures, local_view
from . import colmap_cameras

KIND_KEY = "wildcap_kind"
"""Custom property of such an object: 'camera' or 'scan'."""
MADE_KEY = "wildcap_made_as"
"""Custom property of such an object: its name when it was made. A copy has another one, and is the artist's own."""
FRAME_KEY = "wildcap_frame"
"""Custom property of a camera: the name of its frame."""
CAMERA_SIZE_M = 0.03  # at which cameras are drawn
SENSOR_MM = 36.0  # width; Blender's own default


def bring_in_cameras(context, item, every: bool = False) -> int:
    """Bring in a camera for each frame of the texture, or for every registered frame, and return how many.

    Existing cameras are updated or removed. Raises Problem if the capture has no cameras.
    """
    capture = captures.folder(item)
    cameras = colmap_cameras.read(capture.cameras)
    if not every:
        selection = _selected(capture)
        cameras = [camera for camera in cameras if camera.name in selection] or cameras
    frame = context.scene.camera.get(FRAME_KEY) if context.scene.camera is not None else None
    existing = {thing[FRAME_KEY]: thing for thing in _brought_in(item, 'camera')}
    homes = [home for thing in existing.values() for home in thing.users_collection]
    things = [_camera(context, item, capture, camera, existing.pop(camera.name, None)) for camera in cameras]
    new = [thing for thing in things if not thing.users_collection]
    if new and not homes:
        homes = [bpy.data.collections.new(f"{item.name} Cameras")]
        context.scene.collection.children.link(homes[0])
    for thing in new:
        homes[0].objects.link(thing)
    _remove(existing.values())
    if context.scene.camera is None:
        context.scene.camera = next((thing for thing in things if thing[FRAME_KEY] == frame), things[0])
    local_view.join(context, new)
    return len(cameras)


def bring_in_scan(context, item) -> bpy.types.Object:
    """Bring in the scan as a mesh with its colours, replacing an older one. Raises Problem if the capture has none."""
    capture = captures.folder(item)
    if not capture.scan.is_file():
        raise Problem("This capture has no scan yet.", "Click Reconstruct: it is made from the frames.")
    objects, before = context.view_layer.objects, set(context.scene.objects)
    active = objects.active.name if objects.active is not None else ""
    selection = [thing.name for thing in context.selected_objects]  # by name, as an older scan among them is removed
    with contextlib.suppress(RuntimeError):  # not a PLY: nothing came in
        bpy.ops.wm.ply_import(filepath=str(capture.scan), forward_axis='Y', up_axis='Z')
    new = [thing for thing in context.scene.objects if thing not in before]
    if len(new) != 1 or new[0].type != 'MESH':
        for thing in new:
            bpy.data.objects.remove(thing)
        raise Problem(f"{capture.scan} cannot be read.", advise_again("scan"))
    _remove(_brought_in(item, 'scan'))
    scan = new[0]
    scan.name = scan.data.name = f"{item.name} Scan"
    _mark(scan, context, item, 'scan')
    context.view_layer.update()  # it does not yet know what was removed
    for thing in objects:
        thing.select_set(thing.name in selection)
    objects.active = objects.get(active) or scan
    local_view.join(context, [scan])
    return scan


def _camera(
    context, item, capture: Capture, camera: colmap_cameras.FrameCamera, thing: bpy.types.Object | None
) -> bpy.types.Object:
    """Return the camera of a frame, made if there is none; markers and constraints keep their link to an old one."""
    # data with other users is shared with a copy of the artist's
    shared = thing is None or thing.data.users != 1
    lens = bpy.data.cameras.new(f"{item.name} {camera.name}") if shared else thing.data
    lens.sensor_fit, lens.sensor_width = 'HORIZONTAL', SENSOR_MM
    lens.lens = camera.focal / camera.width * SENSOR_MM
    lens.shift_x = (camera.width / 2 - camera.centre[0]) / camera.width
    lens.shift_y = (camera.centre[1] - camera.height / 2) / camera.width
    lens.display_size = CAMERA_SIZE_M
    lens.clip_start = 0.01
    if (capture.frames / camera.name).is_file():
        lens.show_background_images = True
        image = bpy.data.images.load(str(capture.frames / camera.name), check_existing=True)
        background = next((existing for existing in lens.background_images if existing.image == image), None)
        if background is None:
            background = lens.background_images.new()
            background.image, background.alpha = image, 1.0
        # the sensor has the frame's width: a wider render cuts the frame's height, a narrower one shows more
        render = context.scene.render
        wider = camera.width * render.resolution_y <= camera.height * render.resolution_x
        background.frame_method = 'CROP' if wider else 'FIT'
    if thing is None:
        thing = bpy.data.objects.new(lens.name, lens)
    thing.data = lens
    thing.lock_location = thing.lock_rotation = thing.lock_scale = (True, True, True)
    _mark(thing, context, item, 'camera')
    thing.matrix_basis, thing[FRAME_KEY] = camera.matrix, camera.name
    return thing


def _mark(obj: bpy.types.Object, context, item, kind: str) -> None:
    obj.parent = captures.head(context, item)
    obj[KIND_KEY], obj[captures.HEAD_KEY], obj[MADE_KEY] = kind, item.path, obj.name


def _brought_in(item, kind: str) -> list[bpy.types.Object]:
    """Return the objects that were brought in before, without the artist's copies."""
    things = [t for t in bpy.data.objects if t.get(KIND_KEY) == kind and t.get(captures.HEAD_KEY) == item.path]
    return [t for t in things if t.get(MADE_KEY, t.name) == t.name]


def _remove(things: Iterable[bpy.types.Object]) -> None:
    """Remove objects, with data and collections that nothing else uses."""
    for thing in things:
        kind, data, homes = thing[KIND_KEY], thing.data, list(thing.users_collection)
        bpy.data.objects.remove(thing)
        if data.users == 0:
            (bpy.data.cameras if kind == 'camera' else bpy.data.meshes).remove(data)
        for home in homes:
            if kind == 'camera' and not home.all_objects and home in bpy.data.collections.values():
                bpy.data.collections.remove(home)


def _selected(capture: Capture) -> set[str]:
    """Return the frames that the texture uses."""
    try:
        return {frame.name for frame in read_frames(capture).records if frame.selected}
    except Problem:
        return set()
