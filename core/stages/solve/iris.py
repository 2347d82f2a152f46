# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The colour of eyes that were open: what a frame shows of an iris, over what it shows of the skin around that eye,
whose albedo the solve has found.

So the white point, the exposure and most of the light divide out, frame by frame. The iris is what the eye reader sees
of it where the fitted eyeball has it. What is a highlight, a lash's shadow or a blink in some frames, or in a part of
the iris, the median leaves out. What lies on an eye in all frames (a shadow of the lid or the brow, the sky in the
cornea) is seldom the same on the other one: people's two irises are of one colour, and have the middle of what was
measured.
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

RING_SHARES = 0.55, 0.85
"""Shares of the iris' radius between which it is iris: a pupil is seldom wider than half, and the rim is darker."""
MIN_FACING_COSINE = 0.75
"""Least cosine between the gaze and the way to the camera: beyond 40 degrees the cornea's edge bends what is behind
it."""
MIN_IRIS_SHARE = 0.8
"""Share of the iris in a pixel from which it is nothing else."""
REACH_RADII = 2.6
"""Radii of the eyeball within which skin is lit as the eye is."""
MIN_SKIN_COSINE = 0.5
"""Least cosine between the normals of such skin and the gaze."""
MIN_POINTS = 12  # points of skin, or pixels of the iris, that a frame must show
MAX_VIEWS = 10  # those that face the eye most
ODD_HUES_LOG = 1.2
"""By how much two irises' blue over red, as a logarithm, must differ to be irises of two colours, as few people have
them: half of what parts a brown iris from a blue one."""


def measure_irises(capture: Capture, head: Head, albedo: np.ndarray, report: Reporter) -> None:
    """Writes maps/irises.json; none where the eyes were closed or no frame shows them well.

    Parameters
    ----------
    capture : with its frames
    head : in the capture
    albedo : [S, S, 3], linear, in the head's UVs
    report : takes the colours

    Raises
    ------
    Problem
        For damaged records.
    """
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
    """The linear albedo of the left and of the right iris; None where no frame shows either.

    Parameters
    ----------
    views : with their pictures
    head : as fitted, in metres
    eyes : the left and the right one
    albedo : [S, S, 3], linear, of the head
    report : hears whether it is cancelled
    """
    colours = [measure_iris_colour(views, head, side, eye, albedo, report) for side, eye in enumerate(eyes)]
    known = [colour for colour in colours if colour is not None]
    return even_colours(known[0], known[-1]) if known else None


def even_colours(left: Colour, right: Colour) -> tuple[Colour, Colour]:
    """Both irises in the middle of their linear colours, a geometric mean: what shades an eye is a factor. As they are
    where they are irises of two colours."""
    logs = np.log([left, right])
    hues = logs[:, 2] - logs[:, 0]
    if abs(hues[1] - hues[0]) > ODD_HUES_LOG:
        return left, right
    even = tuple(round(float(v), 4) for v in np.exp(logs.mean(0)))
    return even, even


def measure_iris_colour(
    views: list[View], head: Head, side: int, eye: Eyeball, albedo: np.ndarray, report: Reporter
) -> Colour | None:
    """The albedo of an iris, by the median over it and the frames that face it most.

    Parameters
    ----------
    views : with their pictures
    head : as fitted, in metres
    side : 0 for the left eye, 1 for the right
    eye : of that side
    albedo : [S, S, 3], linear, of the head: what the skin around tells the frame's light by
    report : hears whether it is cancelled

    Returns
    -------
    Linear [3] in [0.001, 1]; None where no frame shows it.
    """
    skin, known = _skin_around(head, eye, albedo)
    if len(skin) < MIN_POINTS or not eye.iris_radius:
        return None
    towards = np.array([view.centre for view in views]) - eye.centre
    facing = towards @ np.array(eye.gaze) / np.linalg.norm(towards, axis=1)
    colours = []
    for i in np.argsort(-facing, kind="stable")[:MAX_VIEWS]:
        report.check()
        if facing[i] < MIN_FACING_COSINE:
            break
        colours.append(_in_frame(views[i], head, side, eye, skin, known))
    colours = [colour for colour in colours if colour is not None]
    return tuple(round(float(v), 4) for v in np.clip(np.median(colours, 0), 0.001, 1)) if colours else None


def find_iris_pixels(
    view: View, eye: Eyeball, shares: EyeShares, shape: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """The pixels that show the iris between pupil and rim: where an eyeball has it, and the reader saw it.

    Parameters
    ----------
    view : the camera
    eye : in metres
    shares : what the reader saw, in the picture's pixels
    shape : of the view's picture

    Returns
    -------
    Rows and columns [N].
    """
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
    """The vertices [N] of plain skin about an eye that are turned as it is, and their linear albedo [N, 3]."""
    mesh, uvs = head.mesh, vertex_uvs(head.mesh)
    plain = raster.sample_uv(weigh_skin(512, np.zeros((8, 8))), uvs) > 0.5
    near = np.linalg.norm(mesh.vertices - eye.centre, axis=1) < REACH_RADII * eye.radius
    rows = np.flatnonzero(plain & near & (head.normals @ np.array(eye.gaze) > MIN_SKIN_COSINE))
    return rows, np.maximum(raster.sample_uv(albedo, uvs[rows]), 1e-3)


def _in_frame(
    view: View, head: Head, side: int, eye: Eyeball, skin: np.ndarray, skin_albedo: np.ndarray
) -> np.ndarray | None:
    """The iris' albedo [3] by one frame; None where that does not show it, or not enough of the skin around."""
    frame = view.read()
    linear, whole = images.srgb_to_linear(frame), frame.max(-1)
    corners = view.project(head.mesh.vertices[list(lids.corners()[side])])[0]
    seen = read_eye(frame, corners * [frame.shape[1] / view.width, frame.shape[0] / view.height], side == 0)
    rows, columns = find_iris_pixels(view, eye, seen, frame.shape)
    at = np.flatnonzero(find_visible(view, head.caster, head.mesh.vertices[skin], head.normals[skin]))
    if len(at) < MIN_POINTS or len(rows) < MIN_POINTS:
        return None
    pixels = view.project(head.mesh.vertices[skin[at]])[0] * [frame.shape[1] / view.width, frame.shape[0] / view.height]
    kept = raster.sample(whole, pixels) < BURNT_SRGB
    if kept.sum() < MIN_POINTS:
        return None
    light = np.median(raster.sample(linear, pixels[kept]) / skin_albedo[at][kept], axis=0)
    return np.median(linear[rows, columns], axis=0) / np.maximum(light, 1e-6)
