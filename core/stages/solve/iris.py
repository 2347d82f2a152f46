# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the colour of open eyes: an iris in a frame over the white around it and over the skin around that eye.

So the white point, the exposure and most of the light divide out, frame by frame, and the tone of the skin does not
count (iris_colours.py). The iris is what the eye reader sees of it inside the fitted eyeball. A highlight, a lash's
shadow or a blink in some frames, or in a part of the iris, is left out by the median. A shadow of the lid or the brow,
or the sky in the cornea, lies on an eye in all frames, but is seldom the same on the other one: people's two irises are
of one colour, and get the middle of both.
"""

from __future__ import annotations

import numpy as np

from ...capture.capture import Capture
from ...capture.eyes_record import SIDES, Colour, Eyeball, read_eyes, write_irises
from ...capture.files import remove_file
from ...capture.messages import Reporter
from ...face import lids, template
from ...face.eye_reader import EyeShares, read_eye
from ...face.head import Head
from ...geometry import raster
from ...geometry.meshes import vertex_uvs
from ...geometry.views import View, read_views
from ...imaging import images
from .iris_colours import average_white, expect_iris
from .look import BURNT_SRGB
from .witnesses import find_visible

RING_SHARES = 0.55, 0.85  # of the iris' radius: a pupil is seldom wider than half, and the rim is darker
MIN_FACING_COSINE = 0.75  # of gaze and way to the camera: beyond 40 degrees the cornea's edge bends what is behind it
MIN_IRIS_SHARE = 0.8  # of the iris in a pixel, and of the white
WHITE_OFF_RADII = 1.15  # of the iris' radius: nearer to its middle its edge blurs into the white
REACH_RADII = 2.6  # of the eyeball, within which skin is lit as the eye is
BEARD_TOP_V = 0.42  # v of the texture below which a beard may grow, whose colour is not the skin's
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

    side is 0 for the left eye, 1 for the right. The head's linear albedo [S, S, 3], over its mean, reveals how the
    frame's light shows the skin's tone around the eye.
    """
    skin, relative = _skin_around(head, eye, albedo)
    if len(skin) < MIN_POINTS or not eye.iris_radius:
        return None
    towards = np.array([view.centre for view in views]) - eye.centre
    facing = towards @ np.array(eye.gaze) / np.linalg.norm(towards, axis=1)
    ratios = []
    for i in np.argsort(-facing, kind="stable")[:MAX_VIEWS]:
        report.check()
        if facing[i] < MIN_FACING_COSINE:
            break
        ratios.append(_measure_in_frame(views[i], head, side, eye, skin, relative))
    over_skin = [over for over, _ in filter(None, ratios)]
    over_white = [over for _, over in filter(None, ratios) if over is not None]
    if not over_skin:
        return None
    colour = expect_iris(np.median(over_skin, 0), np.median(over_white, 0) if over_white else None)
    return tuple(round(float(v), 4) for v in np.clip(colour, 0.001, 1))


def find_eye_pixels(
    view: View, eye: Eyeball, shares: EyeShares, shape: tuple[int, ...]
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Return rows and columns [N] of what the reader calls iris, between pupil and rim, and the white's."""
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
    in_crop = pixels @ shares.move[:, :2].T + shares.move[:, 2]
    ball, iris = (raster.sample(share, in_crop) for share in (shares.ball, shares.iris))
    ring = (away > RING_SHARES[0]) & (away < RING_SHARES[1]) & (iris > MIN_IRIS_SHARE)
    white = (away > WHITE_OFF_RADII) & (ball - iris > MIN_IRIS_SHARE)
    return (rows[ring], columns[ring]), (rows[white], columns[white])


def _plain_skin(size: int) -> np.ndarray:
    """Return weights [size, size] of plain facial skin out of a beard's reach, in the head's UVs."""
    skin = template.mask("skin", size) * template.mask("face", size)
    for name in ("lips", "brows", "eyes", "nostrils"):
        skin = skin * (1 - template.mask(name, size))
    skin[round(size * (1 - BEARD_TOP_V)) :] = 0
    return skin


def _skin_around(head: Head, eye: Eyeball, albedo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices [N] of plain skin about an eye that are turned as it is, and their albedo over its mean."""
    mesh, uvs = head.mesh, vertex_uvs(head.mesh)
    weight = _plain_skin(512)
    plain = raster.sample_uv(weight, uvs) > 0.5
    mean = np.average(images.resize(albedo, 512, 512), axis=(0, 1), weights=weight)
    near = np.linalg.norm(mesh.vertices - eye.centre, axis=1) < REACH_RADII * eye.radius
    rows = np.flatnonzero(plain & near & (head.normals @ np.array(eye.gaze) > MIN_SKIN_COSINE))
    return rows, np.maximum(raster.sample_uv(albedo, uvs[rows]) / mean, 1e-2)


def _measure_in_frame(
    view: View, head: Head, side: int, eye: Eyeball, skin: np.ndarray, relative: np.ndarray
) -> tuple[np.ndarray, np.ndarray | None] | None:
    """Return the iris' ratios [3] to skin of the tone and to the white, None if too little of that is seen, in a frame.

    None instead of both if it does not show the iris, or not enough of the skin around.
    """
    frame = view.read()
    linear, shrink = images.srgb_to_linear(frame), [frame.shape[1] / view.width, frame.shape[0] / view.height]
    corners = view.project(head.mesh.vertices[list(lids.corners()[side])])[0]
    iris, white = find_eye_pixels(view, eye, read_eye(frame, corners * shrink, side == 0), frame.shape)
    at = np.flatnonzero(find_visible(view, head.caster, head.mesh.vertices[skin], head.normals[skin]))
    if len(at) < MIN_POINTS or len(iris[0]) < MIN_POINTS:
        return None
    pixels = view.project(head.mesh.vertices[skin[at]])[0] * shrink
    usable = raster.sample(frame.max(-1), pixels) < BURNT_SRGB
    if usable.sum() < MIN_POINTS:
        return None
    toned = np.median(raster.sample(linear, pixels[usable]) / relative[at][usable], axis=0)
    colour = np.maximum(np.median(linear[iris], axis=0), 1e-4)
    whites = linear[white][frame[white].max(-1) < BURNT_SRGB]
    over_white = colour / np.maximum(average_white(whites), 1e-4) if len(whites) >= MIN_POINTS else None
    return colour / np.maximum(toned, 1e-4), over_white
