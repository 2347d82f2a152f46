# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Views of a person with all that any light needs, made once per figure and kept, for portraits.py."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from core.capture.files import replacing
from core.geometry import raster
from core.geometry.meshes import unit, vertex_normals
from core.geometry.views import View
from core.light.skylight import radiance_transfer

from .figure import Figure
from .unlit import Unlit, random_view, scene_of, trace_unlit

SIDE = 256
CLOSEST, WIDEST = 1.25, 2.0  # side of the picture in sides of the face's landmarks
RAYS = 160
FRONT = np.float32([0, -1, 0])  # the way a head looks, in its axes


@dataclass(frozen=True)
class RelightableView:
    """View of a person with what any light needs.

    position float16 [S, S, 3] of what is visible, in metres about the head's middle; and of the bare head alone, as a
    capture would register it: here bool [S, S], normal int8 [S, S, 3] of 127, transfer float16 [S, S, 9] of the sky's
    coefficients and reach uint8 [S, S, LAMPS] of 255: the share of a lamp that passes the head.
    """

    unlit: Unlit
    position: np.ndarray
    here: np.ndarray
    normal: np.ndarray
    transfer: np.ndarray
    reach: np.ndarray


class Sitter:
    """A figure before the camera: what its views share is computed once."""

    def __init__(self, figure: Figure, rng: np.random.Generator):
        self.scene = scene_of(figure, rng)
        self.bald = raster.RayCaster(figure.head)
        self.normals = vertex_normals(figure.head)
        self.transfer = radiance_transfer(self.bald, figure.head.vertices, self.normals, RAYS)

    def stage(self, rng: np.random.Generator, side: int = SIDE, aside_deg: float = 180) -> RelightableView:
        """Return a view from before the person, at most `aside_deg` from the front; side in pixels."""
        margin = rng.uniform(CLOSEST, WIDEST)
        while True:
            view = random_view(self.scene.figure, rng, side, margin)
            if np.degrees(np.arccos(-view.axis @ FRONT)) <= aside_deg:
                break
        unlit = trace_unlit(self.scene, view, rng)
        mesh = self.bald.mesh
        face, bary, _ = raster.render_view(self.bald, view, 1)
        here = face >= 0
        normal, transfer, reach = (np.zeros((*here.shape, n), np.float32) for n in (3, 9, len(unlit.lamps)))
        towards = unit(raster.interpolate(self.normals, mesh.faces, face[here], bary[here]))
        points = raster.interpolate(mesh.vertices, mesh.faces, face[here], bary[here]) + 1e-3 * towards
        normal[here], transfer[here] = towards, raster.interpolate(self.transfer, mesh.faces, face[here], bary[here])
        for k, lamp in enumerate(unlit.lamps):
            reach[here, k] = ~self.bald.blocked(points, np.repeat(lamp[None], len(points), 0))
        return RelightableView(
            unlit,
            self._position(view),
            here,
            np.round(127 * normal).astype(np.int8),
            transfer.astype(np.float16),
            np.round(255 * reach).astype(np.uint8),
        )

    def _position(self, view: View) -> np.ndarray:
        face, bary, _ = raster.render_view(self.scene.whole, view, 1)
        mesh = self.scene.whole.mesh
        points = raster.interpolate(mesh.vertices, mesh.faces, np.maximum(face, 0), bary)
        points = points - self.bald.mesh.vertices.mean(0)
        return np.where(face[..., None] >= 0, points, 0).astype(np.float16)


def save(path: Path, stage: RelightableView) -> None:
    arrays = {f.name: getattr(stage, f.name) for f in fields(RelightableView) if f.name != "unlit"}
    arrays |= {f"unlit_{f.name}": getattr(stage.unlit, f.name) for f in fields(Unlit)}
    with replacing(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **arrays)


def load(path: Path) -> RelightableView:
    with np.load(path, allow_pickle=False) as stored:
        unlit = Unlit(**{f.name: stored[f"unlit_{f.name}"] for f in fields(Unlit)})
        return RelightableView(unlit, **{name: stored[name] for name in stored if not name.startswith("unlit_")})
