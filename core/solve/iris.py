# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The colour of eyes that were open: what a frame shows of an iris, over what it shows of the skin around that eye, whose albedo the solve has found.

So the white point, the exposure and most of the light divide out, frame by frame. What is a highlight, a lash's shadow or a blink in some frames, or in a part
of the iris, the median leaves out.
"""

from __future__ import annotations

import numpy as np

from ..contract.capture import Capture
from ..contract.eyes_record import SIDES, Colour, Eyeball, read_eyes, write_irises
from ..contract.files import remove_file
from ..contract.messages import Reporter
from ..face import lids
from ..face.head import Head
from ..geometry import raster
from ..geometry.views import View, read_views
from ..imaging import images
from .look import BURNT, skin_weight
from .witnesses import visible

RING = np.linspace(0.55, 0.85, 6)
"""Shares of the iris' radius where it is iris: a pupil is seldom wider than half, and the rim is darker."""
AROUND = 96
FACING = 0.75
"""Least cosine between the gaze and the way to the camera: beyond 40 degrees the cornea's edge bends what is behind it."""
REACH = 2.6
"""Radii of the eyeball within which skin is lit as the eye is."""
TURNED = 0.5
"""Least cosine between the normals of such skin and the gaze."""
FEWEST = 12  # points of skin or iris that a frame must show
MOST_VIEWS = 10


def measure(capture: Capture, head: Head, albedo: np.ndarray, report: Reporter) -> None:
    """maps/irises.json from the frames and a linear albedo [S, S, 3] of the head's UVs; none where the eyes were closed or no frame shows them well.

    Raises Problem for damaged records.
    """
    remove_file(capture.irises)
    if not (head.built_in and capture.eyes.is_file() and capture.frames_json.is_file() and capture.cameras.is_dir()):
        return
    eyes = read_eyes(capture)
    views = [view for view in read_views(capture) if view.path.is_file()]
    colours = [iris_colour(views, head, lids.place_ball(side, np.array(eye.centre), eye.radius, np.array(eye.gaze)), eye, albedo, report)
               for side, eye in enumerate(eyes)]
    known = [colour for colour in colours if colour is not None]
    if not known:
        return
    left, right = (colour if colour is not None else known[0] for colour in colours)
    write_irises(capture.irises, left, right)
    for side, colour in zip(SIDES, (left, right), strict=True):
        report.figure(f"{side}_iris_srgb", [round(float(v), 3) for v in images.linear_to_srgb(np.array(colour))])


def iris_colour(views: list[View], head: Head, ball: lids.Ball, eye: Eyeball, albedo: np.ndarray, report: Reporter) -> Colour | None:
    """Linear albedo of an iris, by the median over its ring and the frames that face it most; None where none shows it."""
    if eye.iris_radius <= 0:
        return None
    ring = iris_ring(ball, eye.iris_radius)
    skin, known = _skin_around(head, ball, albedo)
    if len(skin) < FEWEST:
        return None
    facing = np.array([(view.centre - ball.centre) @ ball.gaze / np.linalg.norm(view.centre - ball.centre) for view in views])
    found = []
    for i in np.argsort(-facing, kind="stable")[:MOST_VIEWS]:
        report.check()
        if facing[i] < FACING:
            break
        found.append(_in_frame(views[i], head, ball, ring, skin, known))
    found = [colour for colour in found if colour is not None]
    return tuple(round(float(v), 4) for v in np.clip(np.median(found, 0), 0.001, 1)) if found else None


def iris_ring(ball: lids.Ball, radius: float) -> np.ndarray:
    """Points [N, 3] on the iris between the pupil and the rim, where the cornea shows them: in the plane that its edge lies in."""
    side = np.cross(ball.gaze, [0, 0, 1.0])
    side /= np.linalg.norm(side)
    up = np.cross(side, ball.gaze)
    turn = np.arange(AROUND) * 2 * np.pi / AROUND
    flat = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * up
    return ball.centre + (1 + lids.CORNEA_BULGE) * ball.radius * ball.gaze + (radius * RING[:, None, None] * flat).reshape(-1, 3)


def _skin_around(head: Head, ball: lids.Ball, albedo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The vertices [N] of plain skin about an eye that are turned as it is, and their linear albedo [N, 3]."""
    mesh, size = head.mesh, len(albedo)
    uv = np.zeros((len(mesh.vertices), 2))
    uv[mesh.faces] = mesh.uvs[mesh.face_uvs]
    pixels = np.stack([uv[:, 0], 1 - uv[:, 1]], 1)
    plain = raster.sample(skin_weight(512, np.zeros((8, 8))), pixels * 512) > 0.5
    near = np.linalg.norm(mesh.vertices - ball.centre, axis=1) < REACH * ball.radius
    rows = np.flatnonzero(plain & near & (head.normals @ ball.gaze > TURNED))
    return rows, np.maximum(raster.sample(albedo, pixels[rows] * size), 1e-3)


def _in_frame(view: View, head: Head, ball: lids.Ball, ring: np.ndarray, skin: np.ndarray, known: np.ndarray) -> np.ndarray | None:
    frame = images.read_srgb(view.path)
    linear, whole = images.srgb_to_linear(frame), frame.max(-1)
    at = np.flatnonzero(visible(view, head.caster, head.mesh.vertices[skin], head.normals[skin]))
    open_to = raster.visible_from(head.caster, ring, np.repeat(ball.gaze[None], len(ring), 0), view.centre)
    if len(at) < FEWEST or open_to.sum() < FEWEST:
        return None
    skin_at, iris_at = view.project(head.mesh.vertices[skin[at]])[0], view.project(ring[open_to])[0]
    kept = raster.sample(whole, skin_at) < BURNT
    if kept.sum() < FEWEST or (iris_at < 0).any() or (iris_at > [view.width, view.height]).any():
        return None
    light = np.median(raster.sample(linear, skin_at[kept]) / known[at][kept], axis=0)
    return np.median(raster.sample(linear, iris_at), axis=0) / np.maximum(light, 1e-6)
