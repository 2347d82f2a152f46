# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Registered head drawn over the frames: its visible edges, and the landmarks it was lifted from."""

import cv2
import numpy as np

from ...face.eye_reader import EyeShares
from ...face.lids import OpenHead
from ...face.parts import to_picture
from ...geometry import raster
from ...geometry.meshes import Mesh, vertex_normals
from ...geometry.views import View
from ...imaging import images
from .eye_looks import EyeLook
from .landmarks import Landmarks

RIM_UV = (0.4 / np.pi) ** 0.6
"""Radius in an eyeball's UVs, over half their width, of the ring at 0.4 radians, near the iris' edge."""
PX_PER_CROP_PX = 4  # pixels of an outline for one of the reader's crop


def overlay(views: list[View], mesh: Mesh, landmarks: Landmarks, height: int = 640) -> np.ndarray:
    """Draw views with the wireframe and, in yellow, the used landmarks: sRGB [height, W, 3]."""
    caster, normals = raster.RayCaster(mesh), vertex_normals(mesh)
    edges = np.unique(np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    return np.hstack([_one(view, mesh, caster, normals, edges, landmarks, height) for view in views])


def eyes_overlay(
    views: list[View],
    landmarks: Landmarks,
    looks: tuple[list[EyeLook], list[EyeLook]],
    opened: OpenHead,
    side: int = 300,
) -> np.ndarray:
    """Draw both eyes in three frames, right then left: sRGB [3 side, 2 side, 3].

    With the edges of the head's lids (green), a ring near the iris' edge (blue) and the ends of ball and iris as read
    (red).
    """
    shares = [{look.view.name: look.shares for look in looks_at_eye} for looks_at_eye in looks]
    return np.vstack(
        [
            np.hstack([_eye(view, shares[which].get(view.name), opened, which, side) for which in (1, 0)])
            for view in three_views(views, landmarks)
        ]
    )


def _eye(view: View, shares: EyeShares | None, opened: OpenHead, eye: int, side: int) -> np.ndarray:
    ball = opened.balls[eye]
    (middle,), (depth,) = view.project(ball.centre[None])
    reach = 1.4 * ball.radius * view.camera.mean_focal_length() / depth
    srgb = view.read()
    scale = side / (2 * reach)
    full = np.array([srgb.shape[1] / view.width, srgb.shape[0] / view.height])
    # cv2's coordinates start at pixel centres
    move = np.column_stack([np.diag(scale / full), side / 2 - scale * middle + 0.5 * scale / full - 0.5])
    canvas = cv2.warpAffine(srgb.astype(np.float32), move, (side, side), flags=cv2.INTER_LINEAR)

    def drawn(points, colour, closed=False):
        at = np.round(((points - middle) * scale + side / 2 - 0.5) * 16).astype(np.int32)
        cv2.polylines(canvas, [at], closed, colour, 1, cv2.LINE_AA, 4)

    for rim in opened.rims[eye]:
        drawn(view.project(opened.skin.vertices[rim])[0], (0.2, 1.0, 0.3))
    iris = ball.mesh.vertices[np.abs(2 * np.linalg.norm(ball.mesh.uvs - 0.5, axis=1) - RIM_UV) < 0.04]
    for x, y in (view.project(iris)[0] - middle) * scale + side / 2 - 0.5:
        cv2.circle(canvas, (round(x), round(y)), 1, (0.2, 0.6, 1.0), -1, cv2.LINE_AA)
    for share in () if shares is None else (shares.ball, shares.iris):
        mask = cv2.resize(share, None, fx=PX_PER_CROP_PX, fy=PX_PER_CROP_PX, interpolation=cv2.INTER_LINEAR) > 0.5
        for line in cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]:
            drawn(to_picture((line[:, 0] + 0.5) / PX_PER_CROP_PX, shares.move), (1.0, 0.2, 0.1), closed=True)
    return canvas


def three_views(views: list[View], landmarks: Landmarks) -> list[View]:
    """Return the leftmost, the middle and the rightmost of the views whose landmarks were used."""
    with_marks = [
        view for view in views if view.name in landmarks.images and landmarks.images[view.name][1].any()
    ] or views
    middle = np.nanmean(landmarks.points, axis=0)
    ordered = sorted(with_marks, key=lambda view: np.arctan2(view.centre[0] - middle[0], middle[1] - view.centre[1]))
    return [ordered[0], ordered[len(ordered) // 2], ordered[-1]]


def _one(view, mesh, caster, normals, edges, landmarks, height):
    srgb = view.read()
    scale = height / view.height
    canvas = np.ascontiguousarray(images.resize(srgb, round(view.width * scale), height))
    pixels, _ = view.project(mesh.vertices)
    visible = raster.visible_from(caster, mesh.vertices, normals, view.centre)
    visible_edges = edges[visible[edges].all(1)]
    shift = 4  # cv2 draws with fractional pixels as fixed-point integers
    lines = np.round((pixels[visible_edges] * scale - 0.5) * 2**shift).astype(np.int32)
    layer = canvas.copy()
    cv2.polylines(layer, list(lines), False, (0.2, 0.9, 1.0), 1, cv2.LINE_AA, shift)
    canvas = 0.55 * canvas + 0.45 * layer
    marks, used = landmarks.images.get(view.name, (np.zeros((0, 2)), np.zeros(0, bool)))
    for x, y in np.round((marks[used] * scale - 0.5) * 2**shift).astype(int):
        cv2.circle(canvas, (int(x), int(y)), 1 << shift, (1.0, 0.85, 0.1), -1, cv2.LINE_AA, shift)
    return canvas
