# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""core/assets/face_units.npz: how the built-in head is cut open, and how its units move it.
research/people/base_head/face_units.py made the file."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

ASSETS = Path(__file__).resolve().parents[2] / "core" / "assets"
SOFT, LEFT_EYE, RIGHT_EYE, JAWS = range(4)
"""What an inner vertex moves with: the rim before it, a ball, the jaws."""
SIDES = ("Left", "Right")
HALF = "eyesHalf"
"""With a side the name of a key that is no unit: it is driven, and bends the way of the lids around the ball."""
MOUTH_SLOT = 2
"""Of the head's materials, the one of its mouth's inside (materials.py)."""
SOCKETS_M = -0.02
"""Height below the eyes' middle above which what is soft inside is a socket, and not the mouth
(core/face/eye_asset.py)."""
GAZE = tuple(f"eye{kind}" for kind in ("Blink", "LookDown", "LookIn", "LookOut", "LookUp", "Squint", "Wide"))
"""Units that mean an open eye: each opens the lids of its side as far as it is used."""


@dataclass(frozen=True)
class FaceUnits:
    """V vertices of the head, C copies on the lower side of lips and lids, P inner ones. Metres, the head's own axes,
    at the template's shape."""

    template: np.ndarray  # [V, 3]
    triangles: np.ndarray  # [F, 3] of the head as it is registered
    copies: np.ndarray  # [C] the vertex that each copy doubles
    seam: np.ndarray  # [C] of the lips (0), the left lids (1) or the right ones (2)
    corners: np.ndarray  # [n, 3]: triangle, corner, the copy it has once cut
    faces: np.ndarray  # [G, 4] of the inner parts, -1 for no fourth corner
    slots: np.ndarray  # [G] material slot: 0 skin, 1 eyes, 2 mouth, 3 teeth
    uvs: np.ndarray  # [P, 2]
    kind: np.ndarray  # [P]
    anchors: np.ndarray  # [P, 6] vertices of the head that carry an inner one
    weights: np.ndarray  # [P, 6], sum 1
    parts: np.ndarray  # [P, 3]
    balls: np.ndarray  # [2, 4] centre and radius of the left and the right eyeball
    mirror: np.ndarray  # [V + C + P] the mirror image of each vertex
    units: dict[str, tuple[np.ndarray, np.ndarray]]  # name -> rows [n], displacements [n, 3]


@cache
def load() -> FaceUnits:
    """The file, with the units of the right side made from those of the left one. The arrays are shared: copy before
    writing."""
    template, triangles = _head()
    with np.load(ASSETS / "face_units.npz", allow_pickle=False) as stored:
        step, mirror = float(stored["step"]), stored["mirror"].astype(int)
        weights = stored["weights"].astype(np.float64)
        units = {}
        for name in stored["names"].tolist():
            units[name] = _unit(stored, name, mirror, step)
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
            units,
        )


def sockets(asset: FaceUnits) -> np.ndarray:
    """Which inner vertices [n] line the sockets behind the lids, of P."""
    return np.flatnonzero((asset.kind == SOFT) & (asset.parts[:, 2] > SOCKETS_M))


def lining(asset: FaceUnits) -> np.ndarray:
    """Which inner vertices [n] line the mouth, of P. Some of the palate's lie as high as a socket."""
    first = len(asset.template) + len(asset.copies)
    corners = asset.faces[asset.slots == MOUTH_SLOT] - first
    deep = np.zeros(len(asset.parts), bool)
    deep[corners[corners >= 0]] = True
    return np.flatnonzero((asset.kind == SOFT) & (deep | (asset.parts[:, 2] <= SOCKETS_M)))


def _unit(stored, name: str, mirror: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    if name.startswith("eyeBlink"):  # back to the lids at rest, from eyes that are open
        rows, moves = _unit(stored, name.replace("eyeBlink", "eyesOpen"), mirror, step)
        return rows, -moves
    left = name.removesuffix("Right") + "Left" if name.endswith("Right") else name
    rows = np.cumsum(stored[f"rows_{left}"].astype(int))
    moves = stored[f"moves_{left}"].T * step
    if name.endswith("Right"):
        return mirror[rows], moves * [-1, 1, 1]
    if not name.endswith("Left"):  # a symmetric one: half of it is stored
        other = mirror[rows] != rows
        return np.concatenate([rows, mirror[rows[other]]]), np.concatenate([moves, moves[other] * [-1, 1, 1]])
    return rows, moves


def _head() -> tuple[np.ndarray, np.ndarray]:
    """Vertices [V, 3] and triangles [F, 3] of the built-in head."""
    vertices, faces = [], []
    for line in (ASSETS / "head.obj").read_text(encoding="ascii").splitlines():
        key, *rest = line.split() or [""]
        if key == "v":
            vertices.append(rest[:3])
        elif key == "f":
            faces.append([corner.split("/")[0] for corner in rest])
    return np.array(vertices, np.float64), np.array(faces, np.int64) - 1
