# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Meter a face under a light, as a photographer's spot meter does, in a small render."""

from math import log2
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from ...core.capture.messages import Problem
from ...core.settings.colour_values import LUMINANCE_WEIGHTS
from ..colours import from_working
from ..data_blocks import load_pixels
from ..hdri import Hdri
from . import output, picture, regions

MIDDLE_GREY = 0.18
"""Luminance that a meter gives the mean of what it sees (ISO 2720)."""
WHITE, BURNT_SHARE = 0.97, 0.005
"""Linear light up to which 8 bits do not clip, and the share of the face that may be brighter."""
SIDE_PX, SAMPLES = 128, 32


def expose(obj: bpy.types.Object, light: str | Hdri, turn: float) -> float:
    """Return the exposure for a head's face under a light, in stops; turn: of the light about the head, in radians.

    Raises Problem if the light does not reach the face.
    """
    scene = picture.set_up_scene(obj, light, SIDE_PX, SAMPLES, turn)
    face = face_pixels(obj, scene)
    with TemporaryDirectory(dir=bpy.app.tempdir) as folder:
        output.render_still(scene, Path(folder) / "face.png", True)
        linear = from_working(load_pixels(Path(folder) / "face.exr")[..., :3])
    return stops_for(linear[face])


def stops_for(linear: np.ndarray) -> float:
    """Return the exposure in stops for linear colours [N, 3] of a face. Raises Problem if they are black or none."""
    mean = float((linear @ LUMINANCE_WEIGHTS).mean()) if len(linear) else 0.0
    if mean < 1e-6:
        raise Problem("No light reaches the face.", "Choose another light, turn it, or raise its strength.")
    brightest = float(np.quantile(linear.max(-1), 1 - BURNT_SHARE))
    return log2(min(MIDDLE_GREY / mean, WHITE / brightest))


def face_pixels(obj: bpy.types.Object, scene: bpy.types.Scene) -> np.ndarray:
    """Return which pixels of the scene's square picture show the head's face, [S, S], rows from the bottom."""
    scene.view_layers[0].update()
    mesh = obj.evaluated_get(scene.view_layers[0].depsgraph).data
    tree = BVHTree.FromPolygons([v.co for v in mesh.vertices], [tuple(p.vertices) for p in mesh.polygons])
    face = np.append(regions.in_face(mesh), False)  # a ray that meets nothing has the index -1
    to_head = obj.matrix_world.inverted() @ scene.camera.matrix_world
    _, _, low, high = scene.camera.data.view_frame(scene=scene)  # the left corners, of a square around the axis
    steps = (np.arange(scene.render.resolution_x) + 0.5) / scene.render.resolution_x
    across, origin = low.y + (high.y - low.y) * steps, to_head.translation
    rays = ((to_head.to_3x3() @ Vector((x, y, low.z)) for x in across) for y in across)
    hits = [[tree.ray_cast(origin, ray)[2] for ray in row] for row in rays]
    return face[[[-1 if index is None else index for index in row] for row in hits]]
