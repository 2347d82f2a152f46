# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes and their files (OBJ with UVs, PLY). World: metres, +Z up, the face towards -Y."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh

from ..contract.capture import replacing
from ..contract.messages import Problem


@dataclass(frozen=True)
class Mesh:
    """Triangles with an optional UV per corner, so that a seam does not split a vertex.

    vertices float64 [V, 3] in metres; faces int64 [F, 3] into them, counter-clockwise from outside;
    uvs float64 [T, 2], origin at the lower left; face_uvs int64 [F, 3] into uvs.
    """

    vertices: np.ndarray
    faces: np.ndarray
    uvs: np.ndarray | None = None
    face_uvs: np.ndarray | None = None

    def moved(self, vertices: np.ndarray) -> Mesh:
        """The same topology at other positions."""
        assert vertices.shape == self.vertices.shape, vertices.shape
        return replace(self, vertices=np.asarray(vertices, np.float64))


def face_normals(mesh: Mesh) -> np.ndarray:
    """Unit normals [F, 3]; zero for a degenerate triangle."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return _unit(np.cross(b - a, c - a))


def vertex_normals(mesh: Mesh) -> np.ndarray:
    """Area-weighted unit normals [V, 3]."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    weighted = np.cross(b - a, c - a)
    total = np.zeros_like(mesh.vertices)
    for i in range(3):
        np.add.at(total, mesh.faces[:, i], weighted)
    return _unit(total)


def read_obj(path: Path) -> Mesh:
    """Triangles and triangulated polygons with their UVs. Raises Problem for a file without faces."""
    vertices, uvs, faces, face_uvs, polygons = [], [], [], [], []
    try:
        text = Path(path).read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise Problem(f"{path} cannot be read ({error.strerror}).", "Run the stage that makes it, or choose another file.") from error
    for line in text.replace("\\\n", " ").splitlines():
        key, *words = line.split() or [""]
        if key == "v":
            vertices.append(words[:3])
        elif key == "vt":
            uvs.append(words[:2])
        elif key == "f":
            corners = [(corner.split("/") + [""])[:2] for corner in words]
            polygons.append(len(corners) - 2)
            for i in range(1, len(corners) - 1):
                triangle = corners[0], corners[i], corners[i + 1]
                faces.append([int(c[0]) for c in triangle])
                face_uvs.append([int(c[1] or 0) for c in triangle])
    if not faces:
        raise Problem(f"{path} holds no faces.", "Choose an OBJ file with a mesh in it.")
    has_uvs = len(uvs) > 0 and min(map(min, face_uvs)) != 0
    mesh = Mesh(np.array(vertices, np.float64), _from_one(faces, len(vertices)),
                np.array(uvs, np.float64) if has_uvs else None, _from_one(face_uvs, len(uvs)) if has_uvs else None)
    return _unfolded(mesh, np.array(polygons))


def write_obj(path: Path, mesh: Mesh) -> None:
    """Positions to a micrometre, UVs to 1e-6, atomically."""
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in mesh.vertices]
    if mesh.uvs is not None:
        lines += [f"vt {u:.6f} {v:.6f}" for u, v in mesh.uvs]
        lines += [f"f {a}/{i} {b}/{j} {c}/{k}" for (a, b, c), (i, j, k) in zip(mesh.faces + 1, mesh.face_uvs + 1, strict=True)]
    else:
        lines += [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
    with replacing(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="ascii")


def read_ply(path: Path) -> Mesh:
    """The triangles of a PLY file."""
    loaded = trimesh.load(path, process=False, force="mesh")
    return Mesh(np.asarray(loaded.vertices, np.float64), np.asarray(loaded.faces, np.int64))


def write_ply(path: Path, mesh: Mesh) -> None:
    """Binary PLY, atomically."""
    with replacing(path) as temporary:
        temporary.write_bytes(trimesh.exchange.ply.export_ply(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)))


def _unfolded(mesh: Mesh, counts: np.ndarray) -> Mesh:
    """The mesh with the fans of hollow polygons begun at a corner from which none of their triangles lies outside, where there is one.

    counts [P]: triangles of each polygon, which lie one after the other.
    """
    if counts.max() < 2 or mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        return mesh
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    whole = np.add.reduceat(across, starts, axis=0)
    hollow = np.logical_or.reduceat((across * np.repeat(whole, counts, 0)).sum(1) < 0, starts)
    faces, face_uvs = mesh.faces.copy(), None if mesh.face_uvs is None else mesh.face_uvs.copy()
    for start, count in zip(starts[hollow], counts[hollow], strict=True):
        own = np.s_[start:start + count]
        for turn in range(1, count + 2):
            ring = np.roll(np.arange(count + 2), -turn)
            fan = np.stack([np.full(count, ring[0]), ring[1:-1], ring[2:]], 1)
            corners = np.append(mesh.faces[own, 1], mesh.faces[start + count - 1, 2])
            corners = np.concatenate([mesh.faces[start, :1], corners])[fan]
            p = mesh.vertices[corners]
            if ((np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) * whole[np.searchsorted(starts, start)]).sum(1) > 0).all():
                faces[own] = corners
                if face_uvs is not None:
                    face_uvs[own] = np.concatenate([mesh.face_uvs[start, :1], mesh.face_uvs[own, 1], mesh.face_uvs[start + count - 1, 2:]])[fan]
                break
    return replace(mesh, faces=faces, face_uvs=face_uvs)


def _from_one(indices: list, count: int) -> np.ndarray:
    """OBJ indices (from one, negative from the end) to indices from zero."""
    indices = np.array(indices, np.int64)
    return np.where(indices < 0, indices + count, indices - 1)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-20)
