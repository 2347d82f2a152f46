# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the colour of open eyes: an iris in a frame over the skin around that eye, whose albedo the solve has found.

So the white point, the exposure and most of the light divide out, frame by frame. The iris is what the eye reader sees
of it inside the fitted eyeball. A highlight, a lash's shadow or a blink in some frames, or in a part of the iris, is
left out by the median. A shadow of the lid or the brow, or the sky in the cornea, lies on an eye in all frames, but is
seldom the same on the other one: people's two irises are of one colour, and get the middle of both.
"""

from __future__ import annotations

import numpy as np

from ...capture.capture import Capture
from ...capture.eyes_record import SIDES, Colour, Eyeball, read_eyes, write_irises
from ...capture.files import remove_file
from ...capture.messages import Reporter
from ...face import lids
from ...face.eye_reader import EyeShares, read_eye
from ...face.head import Head
from ...geometry import raster
from ...geometry.meshes import vertex_uvs
from ...geometry.views import View, read_views
from ...imaging import images
from .look import BURNT_SRGB, weigh_skin
from .witnesses import find_visible

RING_SHARES = 0.55, 0.85  # of the iris' radius: a pupil is seldom wider than half, and the rim is darker
MIN_FACING_COSINE = 0.75  # of gaze and way to the camera: beyond 40 degrees the cornea's edge bends what is behind it
MIN_IRIS_SHARE = 0.8  # of the iris in a pixel
REACH_RADII = 2.6  # of the eyeball, within which skin is lit as the eye is
MIN_SKIN_COSINE = 0.5  # between the normals of such skin and the gaze
MIN_POINTS = 12  # points of skin, or pixels of the iris, that a frame must show
MAX_VIEWS = 10  # those that face the eye most
# least difference of two irises' ln blue / red to be irises of two colours, as few people have them: half of what parts
# a brown iris from a blue one
ODD_HUES_LOG = 1.2


def measure_irises(capture: Capture, head: Head, albedo: np.ndarray, report: Reporter) -> None:
    """Write maps/irises.json by a linear albedo [S, S, 3]; none if no frame shows the eyes well. Raises Problem."""
    remove_file(capture.irises)
    if not (capture.eyes.is_file() and capture.frames_json.is_file() and capture.cameras.is_dir()):
        return
    views = [view for view in read_views(capture) if view.path.is_file()]
    colours = measure_both_irises(views, head, read_eyes(capture), albedo, report)
    if colours is None:
        return
    write_irises(capture.irises, *colours)
    for side, colour in zip(SIDES, colours, strict=True):
        report.figure(f"{side}_iris_srgb", [round(float(v), 3) for v in images.linear_to_srgb(np.array(colour))])


def measure_both_irises(
    views: list[View], head: Head, eyes: tuple[Eyeball, Eyeball], albedo: np.ndarray, report: Reporter
) -> tuple[Colour, Colour] | None:
    """Return the linear albedo of the left and the right iris, or None if no frame shows either."""
    colours = [measure_iris_colour(views, head, side, eye, albedo, report) for side, eye in enumerate(eyes)]
    colours = [colour for colour in colours if colour is not None]
    return even_colours(colours[0], colours[-1]) if colours else None


def even_colours(left: Colour, right: Colour) -> tuple[Colour, Colour]:
    """Return both irises in their geometric mean, for what shades an eye is a factor, but for irises of two colours."""
    logs = np.log([left, right])
    hues = logs[:, 2] - logs[:, 0]
    if abs(hues[1] - hues[0]) > ODD_HUES_LOG:
        return left, right
    even = tuple(round(float(v), 4) for v in np.exp(logs.mean(0)))
    return even, even


def measure_iris_colour(
    views: list[View], head: Head, side: int, eye: Eyeball, albedo: np.ndarray, report: Reporter
) -> Colour | None:
    """Return an iris' linear albedo [3] by the median over it and the frames that face it most; None if none shows it.

    side is 0 for the left eye, 1 for the right. The head's linear albedo [S, S, 3] around the eye reveals the frame's
    light.
    """
    skin, skin_albedo = _skin_around(head, eye, albedo)
    if len(skin) < MIN_POINTS or not eye.iris_radius:
        return None
    towards = np.array([view.centre for view in views]) - eye.centre
    facing = towards @ np.array(eye.gaze) / np.linalg.norm(towards, axis=1)
    colours = []
    for i in np.argsort(-facing, kind="stable")[:MAX_VIEWS]:
        report.check()
        if facing[i] < MIN_FACING_COSINE:
            break
        colours.append(_measure_in_frame(views[i], head, side, eye, skin, skin_albedo))
    colours = [colour for colour in colours if colour is not None]
    return tuple(round(float(v), 4) for v in np.clip(np.median(colours, 0), 0.001, 1)) if colours else None


def find_iris_pixels(
    view: View, eye: Eyeball, shares: EyeShares, shape: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Return rows and columns [N] between pupil and rim of the eyeball's iris that the reader calls iris."""
    shrink = np.array([shape[1] / view.width, shape[0] / view.height])
    (middle,), (depth,) = view.project(np.array(eye.centre)[None])
    reach = 1.5 * eye.radius * view.camera.mean_focal_length() / depth
    low, high = (np.clip(np.round((middle + off) * shrink), 0, shape[1::-1]).astype(int) for off in (-reach, reach))
    rows, columns = (grid.ravel() for grid in np.mgrid[low[1] : high[1], low[0] : high[0]])
    pixels = np.stack([columns, rows], 1) + 0.5
    rays, gaze = view.rays(pixels / shrink), np.array(eye.gaze)
    disc = np.array(eye.centre) + np.sqrt(max(eye.radius**2 - eye.iris_radius**2, 0.0)) * gaze
    along = (disc - view.centre) @ gaze / (rays @ gaze)
    away = np.linalg.norm(view.centre + along[:, None] * rays - disc, axis=1) / max(eye.iris_radius, 1e-6)
    share = raster.sample(shares.iris, pixels @ shares.move[:, :2].T + shares.move[:, 2])
    ring = (away > RING_SHARES[0]) & (away < RING_SHARES[1]) & (share > MIN_IRIS_SHARE)
    return rows[ring], columns[ring]


def _skin_around(head: Head, eye: Eyeball, albedo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices [N] of plain skin about an eye that are turned as it is, and their linear albedo [N, 3]."""
    mesh, uvs = head.mesh, vertex_uvs(head.mesh)
    plain = raster.sample_uv(weigh_skin(512, np.zeros((8, 8))), uvs) > 0.5
    near = np.linalg.norm(mesh.vertices - eye.centre, axis=1) < REACH_RADII * eye.radius
    rows = np.flatnonzero(plain & near & (head.normals @ np.array(eye.gaze) > MIN_SKIN_COSINE))
    return rows, np.maximum(raster.sample_uv(albedo, uvs[rows]), 1e-3)


def _measure_in_frame(
    view: View, head: Head, side: int, eye: Eyeball, skin: np.ndarray, skin_albedo: np.ndarray
) -> np.ndarray | None:
    """Return the iris' albedo [3] by one frame; None if it does not show it, or not enough of the skin around."""
    frame = view.read()
    linear, shrink = images.srgb_to_linear(frame), [frame.shape[1] / view.width, frame.shape[0] / view.height]
    corners = view.project(head.mesh.vertices[list(lids.corners()[side])])[0]
    rows, columns = find_iris_pixels(view, eye, read_eye(frame, corners * shrink, side == 0), frame.shape)
    at = np.flatnonzero(find_visible(view, head.caster, head.mesh.vertices[skin], head.normals[skin]))
    if len(at) < MIN_POINTS or len(rows) < MIN_POINTS:
        return None
    pixels = view.project(head.mesh.vertices[skin[at]])[0] * shrink
    usable = raster.sample(frame.max(-1), pixels) < BURNT_SRGB
    if usable.sum() < MIN_POINTS:
        return None
    light = np.median(raster.sample(linear, pixels[usable]) / skin_albedo[at][usable], axis=0)
    return np.median(linear[rows, columns], axis=0) / np.maximum(light, 1e-6)
