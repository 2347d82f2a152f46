# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Face landmarks on any mesh, whatever its units and axes, by rendering it from several sides.

The face is found in the pictures as in frames of a video, and the marks are cast back onto the surface. Which way is up
and where the face looks is found by trying the 24 ways a mesh can stand along the axes.
"""

from dataclasses import dataclass, replace
from itertools import permutations, product
from pathlib import Path

import cv2
import numpy as np
import pycolmap

from ...capture.messages import Problem, Reporter
from ...face import faces
from ...geometry import raster
from ...geometry.meshes import Mesh, unit, vertex_normals
from ...geometry.views import View
from ...imaging import images
from .landmarks import Landmarks, onto_surface, triangulate

FIRST_SIDE_PX, SIDE_PX = 192, 460
"""Sides of the pictures in which the face is detected, and in which its marks are found."""
FOCAL_SIDES = 2.2  # focal length in picture sides: an angle of view of 26 degrees, as a portrait's
VIEWS_DEG = ((0, 0), (-18, 0), (18, 0), (-35, 0), (35, 0), (0, 12), (0, -12), (-18, 10), (18, 10))
"""Yaw and pitch of the views."""
SKIN, LIPS, BROWS = (0.55, 0.36, 0.28), (0.42, 0.14, 0.13), (0.08, 0.05, 0.04)
"""Linear colours: plain heads are found, painted ones are marked better."""
EYE_LIDS = ((386, 374), (159, 145))  # middle of the upper and the lower lid of the person's left and right eye
TEMPLES = (127, 162, 234, 356, 389, 454)
SURE_SCORE, PORTRAIT_SIDES_FACE_WIDTHS = 0.85, (2.6, 3.4)
"""Score at which a face is accepted without looking further, and sides of pictures of it, in widths of the face."""
FACE_M = 0.11  # distance of the outermost marks at the temples on a person: the first guess of the scale


@dataclass(frozen=True)
class Pose:
    """Pose of the face on a mesh.

    turn [3, 3] takes the mesh's axes to ours (+Z up, face towards -Y); face [3] is the middle of the face in the mesh's
    own coordinates; width is that of the face, in the mesh's units.
    """

    turn: np.ndarray
    face: np.ndarray
    width: float


def find(mesh: Mesh, name: str, report: Reporter) -> tuple[Pose, Landmarks, list[np.ndarray]]:
    """Find the pose of the face, its landmarks as `to_ours` places them, and the sRGB pictures they were found in.

    `name` is that of the mesh's file. Raises Problem where no face is found.
    """
    pose = _find_pose(mesh, name, report)
    posed = mesh.moved(to_ours(mesh.vertices, pose))
    colours, landmarks, pictures = np.tile(SKIN, (len(mesh.vertices), 1)), None, []
    caster, normals = raster.RayCaster(posed), vertex_normals(posed)
    for sides in (VIEWS_DEG[:5], VIEWS_DEG):
        for portrait in PORTRAIT_SIDES_FACE_WIDTHS:
            views, pixels, pictures = [], [], []
            for yaw, pitch in sides:
                report.progress(0, 1, "finding the face on the artist's mesh")
                view = view_from(yaw, pitch, SIDE_PX, FACE_M * portrait)
                picture = shaded(caster, normals, colours, view)
                face = faces.detect(picture)
                if face is not None:
                    views.append(replace(view, name=f"{yaw}_{pitch}"))
                    pixels.append(face.landmarks[:, :2])
                    pictures.append(picture)
            if len(views) > 0.6 * len(sides):
                break
        else:
            raise _no_face(name)
        landmarks = onto_surface(triangulate(views, np.stack(pixels)), views, posed)
        colours = _paint(posed, landmarks.points)
    return pose, landmarks, pictures


def to_ours(points: np.ndarray, pose: Pose) -> np.ndarray:
    """Transform points of the mesh [N, 3] to our axes, in metres, around the middle of its face."""
    return (points - pose.face) @ pose.turn.T * (FACE_M / pose.width)


def _find_pose(mesh: Mesh, name: str, report: Reporter) -> Pose:
    """Find the pose in which the mesh shows the most certain upright face from the front."""
    used = mesh.vertices[np.unique(mesh.faces)]
    middle, size = (used.min(0) + used.max(0)) / 2, np.ptp(used, axis=0).max()
    unit = mesh.moved((mesh.vertices - middle) / size)
    caster, normals, extents = raster.RayCaster(unit), vertex_normals(unit), np.ptp(used, axis=0) / size
    best, turns = (0.0, None), _turns()

    def placed(pose: Pose) -> Pose:
        return Pose(pose.turn, middle + size * pose.face, size * pose.width)

    for first in range(0, len(turns), 4):  # the four ways to face, with one way up
        for window in range(len(_windows(extents))):
            for turn in turns[first : first + 4]:
                report.progress(first, len(turns), "finding the orientation of the artist's mesh")
                windows = _windows(np.abs(turn @ extents))
                if window < len(windows):
                    lift, side = windows[window]
                    sighting = _look(caster, normals, turn, turn.T @ [0, 0, lift], side)
                    for portrait in PORTRAIT_SIDES_FACE_WIDTHS if sighting is not None else ():
                        # detect it again in a close-up, which rejects what is not a face
                        closer = _look(caster, normals, turn, sighting[1].face, portrait * sighting[1].width)
                        best = closer if closer is not None and closer[0] > best[0] else best
            if best[0] > SURE_SCORE:
                return placed(best[1])
    if best[1] is None:
        raise _no_face(name)
    return placed(best[1])


def _windows(sides: np.ndarray) -> list[tuple[float, float]]:
    """Return height over the middle and side of the squares in which a face may lie.

    All of the mesh, its upper half, or, in a figure with a body or arms, what is round the top of its middle. sides [3]
    are the mesh's extents in our axes.
    """
    whole = 1.05 * max(sides[0], sides[2])
    windows = [(0.0, whole), (0.2 * sides[2], 0.75 * whole)]
    smaller = [side for side in (1.2 * sides[2], 0.35 * sides[2], 0.2 * sides[2]) if side < 0.7 * whole]
    return windows + [(max(0.5 * sides[2] - 0.42 * side, 0.0), side) for side in smaller]


def _look(
    caster: raster.RayCaster, normals: np.ndarray, turn: np.ndarray, centre: np.ndarray, extent: float
) -> tuple[float, Pose] | None:
    """Return the score and pose of an upright face in a square of side `extent` around `centre` [3], or None."""
    front = view_from(0, 0, FIRST_SIDE_PX, extent)
    rotation = front.rotation @ turn
    view = replace(front, rotation=rotation, translation=front.translation - rotation @ centre)
    face = faces.detect(shaded(caster, normals, np.tile(SKIN, (len(normals), 1)), view))
    if face is None:
        return None
    marks = face.landmarks[:, :2].astype(np.float64)
    across = marks[list(faces.LEFT_EYE)].mean(0) - marks[list(faces.RIGHT_EYE)].mean(0)
    roll = np.degrees(np.arctan2(across[1], across[0]))
    if abs(roll) > 30 or abs(face.yaw_deg) > 30:
        return None
    rays = view.rays(marks)
    hit, _, distance = caster.first_hits(np.repeat(view.centre[None], len(marks), 0), rays)
    if (hit >= 0).mean() < 0.8:
        return None
    points = view.centre + rays * np.where(hit >= 0, distance, np.nan)[:, None]
    posed = points @ turn.T
    width = np.nanmax(posed[:, 0]) - np.nanmin(posed[:, 0])
    # a face is about as deep as it is wide; the back of a head, where networks see faces too, has no nose
    bulge = np.nanmedian(posed[list(TEMPLES), 1]) - posed[faces.NOSE, 1]
    if not 0.2 < bulge / width < 1.4:
        return None
    score = face.score * np.cos(np.radians(roll)) * np.cos(np.radians(face.yaw_deg))
    return score, Pose(turn, np.nanmedian(points, 0), float(width * 0.8))


def _turns() -> list[np.ndarray]:
    """Return the 24 rotations along the axes, those with +Z up first, then +Y up, then the odd ones."""
    turns = []
    for order in permutations(range(3)):
        for signs in product((1, -1), repeat=3):
            turn = np.zeros((3, 3))
            turn[range(3), order] = signs
            if np.linalg.det(turn) > 0:
                turns.append(turn)

    def rank(turn):  # rows of `turn` are our axes in the mesh's: turn[2] is its up
        up = tuple(np.round(turn[2]).astype(int))
        return ((0, 0, 1), (0, 1, 0), (0, 0, -1), (0, -1, 0), (1, 0, 0), (-1, 0, 0)).index(up)

    return sorted(turns, key=rank)


def view_from(yaw: float, pitch: float, size: int, extent: float) -> View:
    """Return a camera, yaw and pitch degrees off the front, that sees a square around the origin.

    size is its picture's in pixels, extent the square's side in the mesh's units.
    """
    yaw, pitch = np.radians(yaw), np.radians(pitch)
    towards = np.array([np.sin(yaw) * np.cos(pitch), -np.cos(yaw) * np.cos(pitch), np.sin(pitch)])
    right = np.array([np.cos(yaw), np.sin(yaw), 0])
    rotation = np.stack([right, np.cross(-towards, right), -towards])
    camera = pycolmap.Camera(
        model="SIMPLE_PINHOLE", width=size, height=size, params=[FOCAL_SIDES * size, size / 2, size / 2]
    )
    return View("render", Path(), camera, rotation, -rotation @ (towards * extent * FOCAL_SIDES), False)


def shaded(caster: raster.RayCaster, normals: np.ndarray, colours: np.ndarray, view: View) -> np.ndarray:
    """Render a Lambert picture, sRGB [S, S, 3], lit from above the camera.

    Surfaces are lit on the side that is seen; normals [V, 3] are unit, colours [V, 3] linear albedo.
    """
    face, bary, _ = raster.render_view(caster, view)
    normal = unit(raster.interpolate(normals, caster.mesh.faces, face, bary))
    normal *= np.where((normal @ view.axis) > 0, -1, 1)[..., None]
    key = -0.75 * view.axis - 0.55 * view.rotation[1] + 0.35 * view.rotation[0]
    key_light = np.clip(normal @ (key / np.linalg.norm(key)), 0, 1)
    light = 0.75 * key_light + 0.2 + 0.15 * np.clip(-(normal @ view.axis), 0, 1)
    colour = raster.interpolate(colours, caster.mesh.faces, face, bary)
    return images.linear_to_srgb(np.where((face >= 0)[..., None], colour * light[..., None], 0.2))


def _paint(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """Paint brows and lips inside the landmarks' outlines as seen from the front: linear vertex colours [V, 3]."""
    colours = np.tile(SKIN, (len(mesh.vertices), 1))
    front = mesh.vertices[:, 1] < np.nanmax(points[:, 1])
    for outline, colour in ((faces.LIP_LINE, LIPS), *((line, BROWS) for line in faces.BROW_LINES)):
        polygon = points[list(outline)][:, [0, 2]].astype(np.float32)
        if np.isfinite(polygon).all():
            near = np.flatnonzero(
                front
                & (mesh.vertices[:, [0, 2]] >= polygon.min(0)).all(1)
                & (mesh.vertices[:, [0, 2]] <= polygon.max(0)).all(1)
            )
            inside = [
                cv2.pointPolygonTest(polygon, (float(mesh.vertices[v, 0]), float(mesh.vertices[v, 2])), False) >= 0
                for v in near
            ]
            colours[near[np.array(inside, bool)]] = colour
    return colours


def _no_face(name: str) -> Problem:
    return Problem(
        f"No face was found on your head mesh {name} from any side.",
        "Choose an OBJ of a head in a neutral pose, without hair or glasses, or use only the built-in head.",
    )
