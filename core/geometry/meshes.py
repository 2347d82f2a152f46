# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes and their files (OBJ with UVs, PLY). World: metres, +Z up, the face towards -Y."""

from __future__ import annotations

import io
import re
import struct
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh

from ..capture.files import replacing
from ..capture.messages import Problem
from ..capture.stages import advise_remaking
from .mesh_checks import MOST_OBJ_BYTES, MOST_PLY_BYTES, check_ply, damaged, find_fault, open_mesh

OWN_OBJ = re.compile(
    r"((?:v(?: -?[0-9]+\.[0-9]+){3}\n)++)((?:vt(?: -?[0-9]+\.[0-9]+){2}\n)++)"
    r"((?:f(?: [0-9]{1,9}/[0-9]{1,9}){3}\n)++)"
)
"""OBJ text as `write_obj` makes it of a mesh with UVs."""


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
        """Return the same topology at other positions."""
        assert vertices.shape == self.vertices.shape, vertices.shape
        return replace(self, vertices=np.asarray(vertices, np.float64))


def joined(meshes: list[Mesh]) -> Mesh:
    """Join meshes into one without UVs, triangles in order."""
    first = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + k for mesh, k in zip(meshes, first, strict=True)]),
    )


def vertex_uvs(mesh: Mesh) -> np.ndarray:
    """Return one UV of each vertex, [V, 2]."""
    uvs = np.zeros((len(mesh.vertices), 2))
    uvs[mesh.faces] = mesh.uvs[mesh.face_uvs]
    return uvs


def crosses(mesh: Mesh) -> np.ndarray:
    """Return each triangle's normal times twice its area, [F, 3]."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


def face_normals(mesh: Mesh) -> np.ndarray:
    """Return unit normals [F, 3]; zero for a degenerate triangle."""
    return unit(crosses(mesh))


def vertex_normals(mesh: Mesh) -> np.ndarray:
    """Return area-weighted unit normals [V, 3]."""
    weighted = crosses(mesh)
    total = np.zeros_like(mesh.vertices)
    for i in range(3):
        np.add.at(total, mesh.faces[:, i], weighted)
    return unit(total)


def read_obj(path: Path) -> Mesh:
    """Read triangles and polygons, triangulated, with their UVs.

    Raises Problem for a file without faces, and for damage: lines without numbers, positions that are not finite, faces
    with missing vertices.
    """
    path = Path(path)
    text = open_mesh(path, MOST_OBJ_BYTES).decode("utf-8-sig", "replace")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if (own := _read_own(text)) is not None:
        return _sound(path, own)
    vertices, uvs, polygons = _parse(path, text)
    if not polygons:
        raise Problem(f"{path} holds no faces.", "Choose an OBJ file with a mesh in it.")
    # each polygon becomes a fan about its first corner; a corner is (vertex, UV)
    fans = [(p[0], b, c) for p in polygons for b, c in zip(p[1:], p[2:], strict=False)]
    try:
        corners = np.array(fans, np.int64)  # [F, 3, 2]
        faces, face_uvs = corners[..., 0].copy(), corners[..., 1].copy()
        has_uvs = len(uvs) > 0 and face_uvs.min() >= 0
        mesh = Mesh(
            np.array(vertices, np.float64).reshape(-1, 3),
            faces,
            np.array(uvs, np.float64) if has_uvs else None,
            face_uvs if has_uvs else None,
        )
    except (ValueError, OverflowError) as error:
        raise damaged(path, str(error)) from error
    return _unfolded(_sound(path, mesh), np.array([len(p) - 2 for p in polygons]))


def read_obj_vertices(path: Path) -> np.ndarray:
    """Read the vertices [V, 3] of an OBJ without its faces. Raises Problem as `read_obj` does."""
    path = Path(path)
    text = open_mesh(path, MOST_OBJ_BYTES).decode("utf-8-sig", "replace")
    try:
        vertices = np.array(
            [line.split()[1:4] for line in text.splitlines() if line.startswith("v ")], np.float64
        ).reshape(-1, 3)
    except ValueError as error:
        raise damaged(path, str(error)) from error
    if fault := find_fault(vertices, np.zeros((0, 3), np.int64), None, None):
        raise damaged(path, fault)
    return vertices


def write_obj(path: Path, mesh: Mesh) -> None:
    """Write positions to a micrometre and UVs to 1e-6, atomically.

    Raises Problem, and writes nothing, for a mesh without faces or with values that are not finite.
    """
    _check_written(path, mesh)
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in mesh.vertices]
    if mesh.uvs is not None:
        lines += [f"vt {u:.6f} {v:.6f}" for u, v in mesh.uvs]
        lines += [
            f"f {a}/{i} {b}/{j} {c}/{k}" for (a, b, c), (i, j, k) in zip(mesh.faces + 1, mesh.face_uvs + 1, strict=True)
        ]
    else:
        lines += [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
    with replacing(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="ascii")


def read_ply(path: Path, or_points: bool = False) -> Mesh:
    """Read the triangles of a PLY, ASCII or binary of either byte order; polygons are triangulated.

    Raises Problem for a damaged file. `or_points`: points alone give a mesh without faces.
    """
    path = Path(path)
    content = open_mesh(path, MOST_PLY_BYTES)
    check_ply(path, content)
    try:
        loaded = trimesh.load(io.BytesIO(content), file_type="ply", process=False, force=None if or_points else "mesh")
        # an empty file has neither
        points, faces = (getattr(loaded, name, np.zeros((0, 3))) for name in ("vertices", "faces"))
        mesh = Mesh(np.asarray(points, np.float64).reshape(-1, 3), np.asarray(faces, np.int64))
    except (
        ValueError,
        LookupError,
        TypeError,
        AttributeError,
        OverflowError,
        struct.error,
        NotImplementedError,
    ) as error:
        raise damaged(path, str(error).splitlines()[0][:100] if str(error) else type(error).__name__) from error
    if not len(mesh.faces) and not or_points:
        raise damaged(path, "it holds no faces")
    return _sound(path, mesh)


def write_ply(path: Path, mesh: Mesh) -> None:
    """Write a binary PLY, atomically. Raises Problem as `write_obj` does."""
    _check_written(path, mesh)
    with replacing(path) as temporary:
        triangles = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
        temporary.write_bytes(trimesh.exchange.ply.export_ply(triangles))


def write_points(path: Path, points: np.ndarray) -> None:
    """Write points [N, 3] without faces as a binary PLY, atomically."""
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        "element face 0\nproperty list uchar int vertex_indices\nend_header\n"
    )
    with replacing(path) as temporary:
        temporary.write_bytes(header.encode() + points.astype("<f4").tobytes())


def _sound(path: Path, mesh: Mesh) -> Mesh:
    """Return the mesh. Raises Problem if its arrays do not make one."""
    if fault := find_fault(mesh.vertices, mesh.faces, mesh.uvs, mesh.face_uvs):
        raise damaged(path, fault)
    return mesh


def _check_written(path: Path, mesh: Mesh) -> None:
    fault = find_fault(mesh.vertices, mesh.faces, mesh.uvs, mesh.face_uvs)
    if not fault and not len(mesh.faces):
        fault = "it has no faces"
    if fault:
        raise Problem(
            f"{path} was not written: {fault}.",
            advise_remaking(
                Path(path),
                "Run again; if it happens again, report it with this capture's logs. Finished stages are kept.",
            ),
        )


def _read_own(text: str) -> Mesh | None:
    """Parse an OBJ as `write_obj` makes it, three times faster than line by line; None for any other text."""
    written = OWN_OBJ.fullmatch(text)
    if written is None:
        return None
    vertices, uvs = (
        np.array(list(map(float, block.replace(key, "").split()))).reshape(-1, width)
        for block, key, width in ((written[1], "v", 3), (written[2], "vt", 2))
    )
    corners = np.array(list(map(int, written[3].replace("f", "").replace("/", " ").split())), np.int64) - 1
    if corners.min() < 0:
        return None  # an index of zero, which the other reader reports by line
    faces, face_uvs = np.moveaxis(corners.reshape(-1, 3, 2), 2, 0).copy()
    return Mesh(vertices, faces, uvs, face_uvs)


def _parse(path: Path, text: str) -> tuple[list, list, list]:
    """Return the vertices and UVs of an OBJ, as text, and its polygons as lists of corners."""
    vertices, uvs, polygons, corner_of = [], [], [], {}
    for number, line in enumerate(text.replace("\\\n", " ").split("\n"), 1):
        key, *words = line.split() or [""]
        try:
            if key == "v":
                x, y, z = words[:3]
                vertices.append((x, y, z))
            elif key == "vt":
                uvs.append((words[0], words[1] if len(words) > 1 else "0"))
            elif key == "f":
                _, _, _, *_ = words  # three corners at least
                # most corners occur six times
                polygons.append(
                    [corner_of.get(word) or _corner(word, len(vertices), len(uvs), corner_of) for word in words]
                )
        except (ValueError, IndexError):
            raise damaged(path, f"line {number} is {line.strip()!r:.60}") from None
    return vertices, uvs, polygons


def _corner(word: str, vertices: int, uvs: int, corner_of: dict[str, tuple[int, int]]) -> tuple[int, int]:
    """Parse a corner of a face, "3/7/1" or "-1//-1": indices from zero of its vertex and UV (-1: none).

    Negative numbers count back from the `vertices` and `uvs` read so far. Raises ValueError if it is not a corner.
    """
    vertex, uv = (word.split("/") + [""])[:2]
    indices = [
        int(text) - 1 if not text.startswith("-") else int(text) + count
        for text, count in ((vertex, vertices), (uv or "0", uvs))
    ]
    if indices[0] < 0 or uv and indices[1] < 0:
        raise ValueError(word)
    if "-" not in word:  # the meaning of a negative number depends on where it stands
        corner_of[word] = indices[0], indices[1]
    return indices[0], indices[1]


def _unfolded(mesh: Mesh, counts: np.ndarray) -> Mesh:
    """Start the fans of hollow polygons at a corner from which all triangles lie inside, if there is one.

    counts [P]: consecutive triangles of each polygon.
    """
    if counts.max() < 2:
        return mesh
    across = crosses(mesh)
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    whole = np.add.reduceat(across, starts, axis=0)
    hollow = np.logical_or.reduceat((across * np.repeat(whole, counts, 0)).sum(1) < 0, starts)
    faces, face_uvs = mesh.faces.copy(), None if mesh.face_uvs is None else mesh.face_uvs.copy()
    for start, count in zip(starts[hollow], counts[hollow], strict=True):
        own = np.s_[start : start + count]
        for turn in range(1, count + 2):
            ring = np.roll(np.arange(count + 2), -turn)
            fan = np.stack([np.full(count, ring[0]), ring[1:-1], ring[2:]], 1)
            corners = np.append(mesh.faces[own, 1], mesh.faces[start + count - 1, 2])
            corners = np.concatenate([mesh.faces[start, :1], corners])[fan]
            p = mesh.vertices[corners]
            if (
                (np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) * whole[np.searchsorted(starts, start)]).sum(1) > 0
            ).all():
                faces[own] = corners
                if face_uvs is not None:
                    around = [mesh.face_uvs[start, :1], mesh.face_uvs[own, 1], mesh.face_uvs[start + count - 1, 2:]]
                    face_uvs[own] = np.concatenate(around)[fan]
                break
    return replace(mesh, faces=faces, face_uvs=face_uvs)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Return [..., 3] scaled to length 1; zeros stay."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-20)
