# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sockets, eyeballs and lid edges of the built-in head from assets/face_units.npz (see NOTICE.md there)."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..geometry.meshes import Mesh
from . import template

DATA_FILES = ("assets/face_units.npz",)
SOFT = 0  # kind of an inner vertex that follows the rim before it; 1 and 2 are the left and the right eyeball


@dataclass(frozen=True)
class EyeAsset:
    """Eye parts of the asset.

    copies [C], the vertex that each doubles; corners [n, 3] triangle, corner, copy; faces [G, 3] and uvs [P, 2] of the
    sockets; parts [P, 3]; anchors, weights [P, 6]; opens: rows and moves of the left and the right lids; soft_of: the
    rows of each socket; balls [2, 4]; ball meshes.
    """

    copies: np.ndarray
    corners: np.ndarray
    faces: np.ndarray
    uvs: np.ndarray
    parts: np.ndarray
    anchors: np.ndarray
    weights: np.ndarray
    opens: tuple
    soft_of: tuple
    balls: np.ndarray
    ball_meshes: tuple
    rims: tuple


@cache
def load() -> EyeAsset:
    with np.load(template.ASSETS.parent / DATA_FILES[0], allow_pickle=False) as stored:
        z = {name: stored[name] for name in stored.files}
    step, count, copies = float(z["step"]), int(z["head_vertices"]), z["copies"].astype(int)
    lids = z["seam"] > 0
    number = np.full(count + len(copies) + len(z["kind"]), -1)  # of the file's vertices here
    number[:count] = np.arange(count)
    number[count : count + len(copies)] = np.where(lids, count + np.cumsum(lids) - 1, copies)
    first, parts = count + len(copies), z["parts"] * step
    socket = np.flatnonzero((z["kind"] == SOFT) & (parts[:, 2] > -0.02))
    number[first + socket] = count + lids.sum() + np.arange(len(socket))
    quads = z["faces"].astype(int)
    triangles = np.concatenate([quads[:, :3], quads[quads[:, 3] >= 0][:, [0, 2, 3]]])
    inside = np.isin(triangles, first + socket).any(1) & (number[triangles] >= 0).all(1)
    rows = np.cumsum(z["rows_eyesOpenLeft"].astype(int))
    moves = z["moves_eyesOpenLeft"].T * step
    mirror = z["mirror"].astype(int)
    opens = []
    for r, m in ((rows, moves), (mirror[rows], moves * [-1, 1, 1])):
        inside_eye = number[r] >= 0
        opens.append((number[r[inside_eye]], m[inside_eye]))
    weights = z["weights"][socket].astype(np.float64)
    corners = z["corners"][number[z["corners"][:, 2]] >= count].copy()
    corners[:, 2] = number[corners[:, 2]]
    soft = count + lids.sum() + np.arange(len(socket))
    return EyeAsset(
        copies=copies[lids],
        corners=corners,
        faces=number[triangles[inside]],
        uvs=z["uvs"][socket].astype(np.float64),
        parts=parts[socket],
        anchors=z["anchors"][socket].astype(int),
        weights=weights / weights.sum(1, keepdims=True),
        opens=tuple(opens),
        soft_of=(soft[parts[socket, 0] > 0], soft[parts[socket, 0] <= 0]),
        balls=z["balls"].astype(np.float64),
        ball_meshes=tuple(_ball_mesh(z, first, parts, kind) for kind in (1, 2)),
        rims=_rims(z, copies[lids], count),
    )


def _ball_mesh(z: dict, first: int, vertices: np.ndarray, kind: int) -> Mesh:
    """Return an eyeball turned to look straight ahead; the asset's look down by two degrees."""
    rows = np.flatnonzero(z["kind"] == kind)
    number = np.full(len(z["kind"]), -1)
    number[rows] = np.arange(len(rows))
    quads = z["faces"].astype(int) - first
    quads = quads[(quads[:, :3] >= 0).all(1)]
    quads = quads[(number[quads[:, :3]] >= 0).all(1)]
    triangles = number[np.concatenate([quads[:, :3], quads[quads[:, 3] >= 0][:, [0, 2, 3]]])]
    uvs, centre = z["uvs"][rows].astype(np.float64), z["balls"][kind - 1, :3].astype(np.float64)
    pupil = vertices[rows][np.linalg.norm(uvs - 0.5, axis=1).argmin()] - centre
    straight = centre + (vertices[rows] - centre) @ turn_towards(pupil / np.linalg.norm(pupil))
    return Mesh(straight, triangles, uvs, triangles)


def _rims(z: dict, doubled: np.ndarray, count: int) -> tuple:
    """Return the edges of the lids, each from the nose outwards, without the corners."""
    vertices, seam = template.load().vertices, z["seam"][z["seam"] > 0]
    result = []
    for side in (1, 2):
        on_side = np.flatnonzero(seam == side)
        on_side = on_side[np.argsort(np.abs(vertices[doubled[on_side], 0]))]
        result.append((doubled[on_side], count + on_side))
    return tuple(result)


def turn_by(radians: np.ndarray) -> np.ndarray:
    """Return the rotation [3, 3] of an eye that looks along -y to the person's left (+x) and up."""
    (c, s), (d, t) = (np.cos(radians[0]), np.sin(radians[0])), (np.cos(radians[1]), np.sin(radians[1]))
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, d, t], [0, -t, d]])


def turn_towards(gaze: np.ndarray) -> np.ndarray:
    """Return the rotation [3, 3] of an eye from straight ahead to the unit vector gaze [3].

    It turns left or right first, then up or down, without roll.
    """
    return turn_by(np.array([np.arctan2(gaze[0], -gaze[1]), np.arcsin(np.clip(gaze[2], -1, 1))]))
