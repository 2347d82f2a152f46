# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Registered head of a capture, read once per stage: its mesh and what is derived from it on demand.

All arrays are shared between those who hold the head, and are read-only: copy before writing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..capture.capture import Capture
from ..capture.eyes_record import read_eyes
from ..capture.messages import Problem
from ..capture.stages import advise_again
from ..geometry import meshes, raster
from ..geometry.meshes import Mesh, unit
from . import lids, template


class Head:
    """Built-in head in the world (metres), with the UVs of its masks."""

    eyes_open = False
    """True if the lids are open as filmed: then the vertices are those of lids.OpenHead."""

    def __init__(self, mesh: Mesh, before: Mesh | None = None):
        """Take a mesh, and all geometry that occludes it, itself included, where that is more: sockets and eyeballs."""
        self.mesh = mesh
        self._before = before or mesh
        self._rasters: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    @cached_property
    def normals(self) -> np.ndarray:
        """Area-weighted unit normals [V, 3]."""
        return _shared(meshes.vertex_normals(self.mesh))

    @cached_property
    def caster(self) -> raster.RayCaster:
        """Ray caster; its triangles are the mesh's, then those of what lies before it."""
        return raster.RayCaster(self._before)

    def raster(self, size: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the triangle that covers each texel: face int32 [S, S] (-1: none) and bary float32 [S, S, 3]."""
        if size not in self._rasters:
            face, bary = raster.rasterize_uv(self.mesh, size)
            self._rasters[size] = _shared(face), _shared(bary)
        return self._rasters[size]

    def interpolate(self, vertex_values: np.ndarray, size: int) -> np.ndarray:
        """Interpolate values of the vertices [V, C] at a map's texels [S, S, C], zero off the head."""
        return raster.interpolate(vertex_values, self.mesh.faces, *self.raster(size))

    def unfold(self, size: int) -> Unfolded:
        face, bary = self.raster(size)
        inside = face >= 0
        points, normals = (
            raster.interpolate(attribute, self.mesh.faces, face[inside], bary[inside])
            for attribute in (self.mesh.vertices, self.normals)
        )
        normals = unit(normals)
        return Unfolded(self, face, bary, _shared(points), _shared(normals))


@dataclass(frozen=True)
class Unfolded:
    """Head in its UVs.

    face int32 [S, S] (-1: none) and bary float32 [S, S, 3] of the raster; points (metres) and unit normals [N, 3] of
    its N covered texels, row by row.
    """

    head: Head
    face: np.ndarray
    bary: np.ndarray
    points: np.ndarray
    normals: np.ndarray

    @property
    def mesh(self) -> Mesh:
        return self.head.mesh

    @property
    def caster(self) -> raster.RayCaster:
        return self.head.caster

    @cached_property
    def covered(self) -> np.ndarray:
        """Texels of the head, bool [S, S]."""
        return _shared(self.face >= 0)

    def covered_at(self, size: int) -> np.ndarray:
        """Return the texels of the head in a map of another size, bool [size, size]."""
        return self.covered if size == len(self.covered) else self.head.raster(size)[0] >= 0

    def spread(self, texel_values: np.ndarray) -> np.ndarray:
        """Scatter values of the covered texels [N(, C)] into float32 [S, S(, C)], zero elsewhere."""
        out = np.zeros((*self.face.shape, *texel_values.shape[1:]), np.float32)
        out[self.covered] = texel_values
        return out


def read_head(capture: Capture) -> Head:
    """Read the registered head.

    Raises Problem where head.obj is missing, damaged or another mesh: what works on a head knows its vertices,
    triangles and UVs.
    """
    mesh = meshes.read_obj(capture.head)
    if not template.is_built_in(mesh):
        raise Problem(
            f"{capture.head} is not WildCap's head: its triangles or UVs differ.", advise_again("registration")
        )
    for array in (mesh.vertices, mesh.faces, mesh.uvs, mesh.face_uvs):
        _shared(array)
    return Head(mesh)


def read_filmed_head(capture: Capture) -> Head:
    """Read the head as filmed, with the UVs and triangles of `read_head`'s.

    Where its eyes were open its lids are open, with eyeballs between them, so that no iris is seen on a lid. Raises
    Problem as `read_head` does, and where head_open.obj or eyes.json is damaged.
    """
    head = read_head(capture)
    if not (capture.head_open.is_file() and capture.eyes.is_file()):
        return head
    opened = meshes.read_obj(capture.head_open)
    if not lids.belongs_to(opened, head.mesh):  # head.obj was replaced
        return head
    return FilmedHead(
        head.mesh,
        opened,
        [
            lids.place_ball(side, np.array(eye.centre), eye.radius, np.array(eye.gaze)).mesh
            for side, eye in enumerate(read_eyes(capture))
        ],
    )


class FilmedHead(Head):
    """Head with its triangles parted between the lids."""

    eyes_open = True

    def __init__(self, closed: Mesh, opened: Mesh, balls: list[Mesh]):
        """Take the closed head, the same with open lids and its sockets, and the eyeballs."""
        faces = _shared(opened.faces[: len(closed.faces)])
        super().__init__(
            replace(closed, vertices=_shared(opened.vertices), faces=faces), meshes.joined([opened, *balls])
        )


def _shared(array: np.ndarray) -> np.ndarray:
    """Make an array read-only."""
    array.setflags(write=False)
    return array
