# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Built-in head cut open at the lids, with sockets and eyeballs from assets/face_units.npz (see NOTICE.md there).

The lips stay closed. The head's triangles keep their numbers, so what is painted in its UVs stays where it was.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.meshes import Mesh
from . import eye_asset, template
from .eye_asset import EyeAsset, turn_by, turn_towards

CORNEA_BULGE_SHARE, CORNEA_ANGLE_RAD = 0.06, 0.52  # of the asset's eyeballs: share of the radius, radians
CLEAR_M = 0.0004  # gap between ball and lid
SAME_M = 1e-5  # maximum distance to count as unmoved
DEEPEST_M = 0.003  # maximum depth of a point in a ball to push it out
FORWARD = np.array([0, -1.0, 0])  # direction of the face in the head's axes
REST_M = -0.003, 0.010  # range of an eyeball behind the place that its surroundings suggest


@dataclass(frozen=True)
class PosedEyeball:
    """Eyeball in place.

    centre [3] and radius in metres; gaze [3] unit; mesh with UVs whose distance from the middle (0.5, 0.5) grows with
    the angle from the pupil: 0.5 (angle / pi)^0.6.
    """

    centre: np.ndarray
    radius: float
    gaze: np.ndarray
    mesh: Mesh


@dataclass(frozen=True)
class OpenHead:
    """Head with open lids.

    skin: the head and its sockets in the template's UVs, the template's triangles first; balls: the left and the right
    eye; rims: upper and lower edge of the left and the right lids as vertex numbers [N], from the inner corner
    outwards.
    """

    skin: Mesh
    balls: tuple[PosedEyeball, PosedEyeball]
    rims: tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def open_lids(head: Mesh, openness: float, gaze: np.ndarray) -> OpenHead:
    """Open the lids of a closed head of the template's topology.

    openness in [0, 1]: 0 shut, 1 as far as MakeHuman opens them; gaze [2]: degrees that both eyes turn to the person's
    left and up.
    """
    turn = turn_by(np.radians(gaze))
    return open_around(
        head, tuple(place_ball(side, *carry_ball(head, side), turn @ FORWARD) for side in (0, 1)), (openness, openness)
    )


def open_around(
    head: Mesh, balls: tuple[PosedEyeball, PosedEyeball], openness: tuple[float, float], shift: np.ndarray | float = 0.0
) -> OpenHead:
    """Open the lids of a closed head around the left and the right eyeball.

    openness is each eye's share of MakeHuman's opening; shift [V + C + P, 3], metres, moves all vertices besides,
    before the lids are pushed out of the balls.
    """
    unit = eye_asset.load()
    rest = np.concatenate([head.vertices, head.vertices[unit.copies], _carried(unit, head)]) + shift
    scale = _scale(unit, head)
    for side, ball in enumerate(balls):
        rows, moves = unit.opens[side]
        rest[rows] = push_out(rest[rows] + openness[side] * moves * scale, ball)
        soft = unit.soft_of[side]
        rest[soft] = push_out(rest[soft], ball)
    return OpenHead(_skin(unit, head, rest), tuple(balls), unit.rims)


def carry_ball(head: Mesh, side: int) -> tuple[np.ndarray, float]:
    """Return centre [3] and radius of the left (0) or right (1) eyeball of a head.

    It moves from the template as the lids before it do, then back until the closed lids clear it.
    """
    unit, rest = eye_asset.load(), template.load().vertices
    centre, radius = unit.balls[side, :3], unit.balls[side, 3]
    arm = rest - centre
    near = np.flatnonzero((np.linalg.norm(arm, axis=1) < 1.35 * radius) & (arm[:, 1] < -0.3 * radius))
    moved = centre + (head.vertices[near] - rest[near]).mean(0)
    radius = radius * _scale(unit, head)

    def clearance(back: float) -> float:
        v = head.vertices[near] - (moved + [0, back, 0])
        length = np.linalg.norm(v, axis=1)
        return float((length - _surface(v / length[:, None], FORWARD, radius)).min())

    low, high = REST_M
    for _ in range(20):
        middle = (low + high) / 2
        low, high = (low, middle) if clearance(middle) > CLEAR_M else (middle, high)
    return moved + [0, high, 0], float(radius)


def place_ball(side: int, centre: np.ndarray, radius: float, gaze: np.ndarray) -> PosedEyeball:
    """Place the left (0) or right (1) eyeball at centre [3] with a radius, metres, looking along the unit gaze [3]."""
    unit = eye_asset.load()
    mesh, (x, y, z, size) = unit.ball_meshes[side], unit.balls[side]
    vertices = centre + (mesh.vertices - [x, y, z]) @ turn_towards(gaze).T * (radius / size)
    return PosedEyeball(
        np.asarray(centre, np.float64), float(radius), np.asarray(gaze, np.float64), mesh.moved(vertices)
    )


@cache
def corners() -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the vertices at the outer and the inner corner of the left and of the right eye.

    They are those that both lids' last edges share.
    """
    unit, head = eye_asset.load(), template.load()
    faces = head.faces.copy()
    faces[unit.corners[:, 0], unit.corners[:, 1]] = unit.corners[:, 2]

    def corner(ends: tuple[int, int]) -> int:
        (shared,) = set.intersection(*(set(faces[(faces == vertex).any(1)].ravel().tolist()) for vertex in ends))
        return shared

    return tuple(tuple(corner((upper[end], lower[end])) for end in (-1, 0)) for upper, lower in unit.rims)


def edges(vertices: np.ndarray, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Return both edges [N, 3] of the left (0) or right lids of an open head, from the outer corner to the inner.

    The upper edge comes first.
    """
    return _edge(vertices, side, 0), _edge(vertices, side, 1)


def closed_edge(vertices: np.ndarray, side: int, lid: int, off: float) -> np.ndarray:
    """Return the line [N, 3] where closed lids meet, moved by `off` metres onto the upper (0) or lower (1) lid.

    vertices [V, 3] are the head's, side is 0 for the left eye; the line runs from the outer corner to the inner one.
    """
    edge = _edge(vertices, side, 0)  # its vertices are the head's own; the lower lid's are doubles of them
    rows = rows_of_lid(side, lid)
    skin = vertices[rows[(rows < len(vertices)) & ~np.isin(rows, eye_asset.load().rims[side][0])]]
    away = skin[cKDTree(skin).query(edge, 3)[1]].mean(1) - edge
    return edge + off * away / np.linalg.norm(away, axis=1, keepdims=True)


def _edge(vertices: np.ndarray, side: int, lid: int) -> np.ndarray:
    outer, inner = corners()[side]
    return vertices[[outer, *eye_asset.load().rims[side][lid][::-1], inner]]


def rows_of_lid(side: int, lid: int) -> np.ndarray:
    """Return the vertices [N] of an open head that move with an upper (0) or lower (1) lid; side 0 is the left eye."""
    unit, head = eye_asset.load(), template.load()
    rows, upper = unit.opens[side][0], unit.rims[side][0]
    order = upper[np.argsort(head.vertices[upper, 0])]
    x, _, z = head.vertices[np.minimum(rows, len(head.vertices) - 1)].T
    # of the skin: above where the lids meet
    above = z > np.interp(x, head.vertices[order, 0], head.vertices[order, 2]) - 1e-7
    above[np.isin(rows, unit.rims[side][1])] = False
    count = len(head.vertices) + len(unit.copies)
    height = np.zeros(len(head.vertices))
    height[head.faces] = head.uvs[head.face_uvs][..., 1]
    inside = rows >= count  # a socket's UVs go on from those of its lid, up or down
    socket = rows[inside] - count
    above[inside] = unit.uvs[socket, 1] > (unit.weights * height[unit.anchors])[socket].sum(1)
    return rows[above == (lid == 0)]


def belongs_to(opened: Mesh, head: Mesh) -> bool:
    """Return True if the skin of an open head is that closed one's: built alike, and equal where no lid moves."""
    unit, moving = eye_asset.load(), np.zeros(len(head.vertices), bool)
    count = len(head.vertices) + len(unit.copies) + len(unit.parts)
    if len(opened.vertices) != count or len(opened.faces) != len(head.faces) + len(unit.faces):
        return False
    for rows, _ in unit.opens:
        moving[rows[rows < len(moving)]] = True
    return bool(np.abs(opened.vertices[: len(moving)] - head.vertices)[~moving].max() < SAME_M)


def push_out(points: np.ndarray, ball: PosedEyeball) -> np.ndarray:
    """Push points [N, 3] out of the front of an eyeball, CLEAR_M away from it."""
    v = points - ball.centre
    length = np.linalg.norm(v, axis=1, keepdims=True)
    v = v / length
    short = np.clip(_surface(v, ball.gaze, ball.radius) + CLEAR_M - length[:, 0], 0, DEEPEST_M) * (v[:, 1] < -0.2)
    return points + v * short[:, None]


def _carried(unit: EyeAsset, head: Mesh) -> np.ndarray:
    """Return the sockets' vertices [P, 3] on another head, moved as the rims before them are."""
    shift = head.vertices - template.load().vertices
    return unit.parts + (unit.weights[..., None] * shift[unit.anchors]).sum(1)


def _scale(unit: EyeAsset, head: Mesh) -> float:
    """Return the width of the head's eyes over the template's."""
    rim = np.concatenate([upper for upper, _ in unit.rims])
    return float(np.ptp(head.vertices[rim, 0]) / np.ptp(template.load().vertices[rim, 0]))


def _surface(direction: np.ndarray, gaze: np.ndarray, radius: float) -> np.ndarray:
    """Return the distance of an eyeball's surface, cornea included, from its centre along unit directions [N, 3]."""
    angle = np.arccos(np.clip(direction @ gaze, -1, 1))
    return radius * (1 + CORNEA_BULGE_SHARE * np.clip(1 - (angle / CORNEA_ANGLE_RAD) ** 2, 0, None))


def _skin(unit: EyeAsset, head: Mesh, vertices: np.ndarray) -> Mesh:
    """Join the head's triangles, parted at the lids, and those of the sockets with the UVs of the skin beside them."""
    faces = head.faces.copy()
    faces[unit.corners[:, 0], unit.corners[:, 1]] = unit.corners[:, 2]
    uv_of = np.zeros((len(vertices), 2))
    uv_of[faces] = head.uvs[head.face_uvs]
    uv_of[-len(unit.uvs) :] = unit.uvs
    uvs = np.concatenate([head.uvs, uv_of[unit.faces].reshape(-1, 2)])
    face_uvs = np.concatenate([head.face_uvs, len(head.uvs) + np.arange(3 * len(unit.faces)).reshape(-1, 3)])
    return replace(head, vertices=vertices, faces=np.concatenate([faces, unit.faces]), uvs=uvs, face_uvs=face_uvs)
