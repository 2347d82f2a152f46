# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Face units of the built-in head, and how its mesh is cut open for them: core/assets/face_units.npz.

research/people/base_head/face_units.py makes the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

ASSETS = Path(__file__).resolve().parents[2] / "core" / "assets"
SOFT, LEFT_EYE, RIGHT_EYE, JAWS = range(4)
"""Carrier of an inner vertex: the rim in front of it, an eyeball, the jaws."""
SIDES = ("Left", "Right")
HALF = "eyesHalf"
"""With a side, a driven shape key that bends the lids' path around the eyeball; not a unit."""
MOUTH_SLOT = 2
"""Material slot of the inside of the mouth (materials.py)."""
SOCKETS_M = -0.02
"""Height relative to the eyes above which soft inner parts belong to a socket, not to the mouth
(core/face/eye_asset.py)."""
GAZE = tuple(f"eye{kind}" for kind in ("Blink", "LookDown", "LookIn", "LookOut", "LookUp", "Squint", "Wide"))
"""Units that imply an open eye: each opens the lids on its side in proportion to its value."""


@dataclass(frozen=True)
class FaceUnits:
    """Mesh and units at the template's shape, in metres and the head's axes.

    V vertices of the head are followed by C copies on the lower side of lips and lids and P inner vertices.
    """

    template: np.ndarray  # [V, 3]
    triangles: np.ndarray  # [F, 3] of the registered head
    copies: np.ndarray  # [C] vertex that each copy doubles
    seam: np.ndarray  # [C] 0 for the lips, 1 for the left lids, 2 for the right lids
    corners: np.ndarray  # [n, 3]: triangle, corner, and the copy that replaces its vertex
    faces: np.ndarray  # [G, 4] of the inner parts, -1 where there is no fourth corner
    slots: np.ndarray  # [G] material slot: 0 skin, 1 eyes, 2 mouth, 3 teeth
    uvs: np.ndarray  # [P, 2]
    kind: np.ndarray  # [P]
    anchors: np.ndarray  # [P, 6] head vertices that carry an inner one
    weights: np.ndarray  # [P, 6], sum 1
    parts: np.ndarray  # [P, 3]
    balls: np.ndarray  # [2, 4] centre and radius of the left and the right eyeball
    mirror: np.ndarray  # [V + C + P] mirror image of each vertex
    units: dict[str, tuple[np.ndarray, np.ndarray]]  # name -> rows [n], displacements [n, 3]

    @property
    def first_inner(self) -> int:
        return len(self.template) + len(self.copies)

    def cut_triangles(self) -> np.ndarray:
        """Return the head's triangles [F, 3] with the copies along the seams."""
        triangles = self.triangles.copy()
        triangles[self.corners[:, 0], self.corners[:, 1]] = self.corners[:, 2]
        return triangles

    def inner_faces(self) -> list[list[int]]:
        return [[corner for corner in face if corner >= 0] for face in self.faces.tolist()]


@cache
def load() -> FaceUnits:
    """Read the file and mirror the units of the left side. The arrays are shared: copy before writing."""
    template, triangles = _read_head()
    with np.load(ASSETS / "face_units.npz", allow_pickle=False) as stored:
        step, mirror = float(stored["step"]), stored["mirror"].astype(int)
        weights = stored["weights"].astype(np.float64)
        return FaceUnits(
            template,
            triangles,
            stored["copies"].astype(int),
            stored["seam"],
            stored["corners"],
            stored["faces"].astype(int),
            stored["slots"],
            stored["uvs"],
            stored["kind"],
            stored["anchors"].astype(int),
            weights / np.maximum(weights.sum(1, keepdims=True), 1e-9),
            stored["parts"] * step,
            stored["balls"].astype(np.float64),
            mirror,
            {name: _read_unit(stored, name, mirror, step) for name in stored["names"].tolist()},
        )


def sockets(asset: FaceUnits) -> np.ndarray:
    """Return the inner vertices [n] that line the sockets behind the lids, counted within P."""
    return np.flatnonzero((asset.kind == SOFT) & (asset.parts[:, 2] > SOCKETS_M))


def lining(asset: FaceUnits) -> np.ndarray:
    """Return the inner vertices [n] that line the mouth, counted within P; the palate reaches up to the sockets."""
    corners = asset.faces[asset.slots == MOUTH_SLOT] - asset.first_inner
    deep = np.zeros(len(asset.parts), bool)
    deep[corners[corners >= 0]] = True
    return np.flatnonzero((asset.kind == SOFT) & (deep | (asset.parts[:, 2] <= SOCKETS_M)))


def _read_unit(stored, name: str, mirror: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    if name.startswith("eyeBlink"):  # from open eyes back to the lids at rest
        rows, moves = _read_unit(stored, name.replace("eyeBlink", "eyesOpen"), mirror, step)
        return rows, -moves
    left = name.removesuffix("Right") + "Left" if name.endswith("Right") else name
    rows = np.cumsum(stored[f"rows_{left}"].astype(int))
    moves = stored[f"moves_{left}"].T * step
    if name.endswith("Right"):
        return mirror[rows], moves * [-1, 1, 1]
    if not name.endswith("Left"):  # only half of a symmetric unit is stored
        other = mirror[rows] != rows
        return np.concatenate([rows, mirror[rows[other]]]), np.concatenate([moves, moves[other] * [-1, 1, 1]])
    return rows, moves


def _read_head() -> tuple[np.ndarray, np.ndarray]:
    """Read vertices [V, 3] and triangles [F, 3] of the built-in head."""
    lines = [line.split() for line in (ASSETS / "head.obj").read_text(encoding="ascii").splitlines()]
    vertices = [line[1:4] for line in lines if line and line[0] == "v"]
    faces = [[corner.split("/")[0] for corner in line[1:]] for line in lines if line and line[0] == "f"]
    return np.array(vertices, np.float64), np.array(faces, np.int64) - 1
