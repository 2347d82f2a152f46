# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Artist's own head mesh: an OBJ, or a folder of one neutral OBJ with identity and expression shapes beside it.

The folder is laid out as ICT-FaceKit (Li et al. 2020). The mesh is written back with nothing changed but its positions.
"""

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...capture.files import replacing
from ...capture.messages import Problem, Reporter
from ...geometry import atlas, meshes
from ...geometry.meshes import Mesh

LEAST_VERTICES = 300
MOST_VERTICES = 400_000
MOST_SHAPES = 60
"""Maximum number of shapes: more say little about a face, and each costs memory; an identity space begins with its
strongest."""
EXPRESSION_SIGMA = 0.4
"""Prior deviation of an expression's coefficient: shapes go from 0 to 1, and the head is fitted at rest."""


@dataclass(frozen=True)
class OwnMesh:
    """Artist's mesh.

    mesh: the file's vertices, in its order, units and axes, its polygons cut into triangles; shapes float32 [K, V, 3]
    displacements per standard deviation of their coefficients, in the same units; path of the OBJ; new_atlas: the UVs
    are not the file's.
    """

    mesh: Mesh
    shapes: np.ndarray
    path: Path
    new_atlas: bool = False


def read(chosen: str, report: Reporter) -> OwnMesh:
    """Read an OBJ or a folder.

    Raises Problem for a file that is not a head mesh.
    """
    path = Path(chosen)
    if not path.exists():
        raise Problem(
            f"There is no head mesh at {path}.",
            "Choose an OBJ file or a folder of shapes under Head Mesh, or use only the built-in head.",
        )
    neutral, others = _folder(path) if path.is_dir() else (path, [])
    mesh = meshes.read_obj(neutral)
    _check(mesh, neutral)
    shapes = []
    for i, other in enumerate(others):
        report.progress(i, len(others), f"reading the shape {other.stem}")
        positions = _positions(other)
        if positions.shape != mesh.vertices.shape:
            raise Problem(
                f"The shape {other.name} has {len(positions)} vertices, the neutral mesh {neutral.name} has "
                f"{len(mesh.vertices)}.",
                "Leave in the folder only shapes of the same mesh, in the same vertex order.",
            )
        scale = 1.0 if _is_identity(other) else EXPRESSION_SIGMA
        shapes.append(((positions - mesh.vertices) * scale).astype(np.float32))
    return OwnMesh(mesh, np.array(shapes, np.float32).reshape(-1, *mesh.vertices.shape), neutral)


def with_usable_uvs(own: OwnMesh, skin: np.ndarray, allowed: bool, size: int) -> tuple[OwnMesh, str]:
    """Return the mesh with UVs that a map can be painted in, and their origin in words.

    skin bool [F] marks the triangles to paint; size is the map's in texels. Raises Problem for unusable UVs unless a
    new atlas is allowed.
    """
    skin_mesh = replace(
        own.mesh, faces=own.mesh.faces[skin], face_uvs=None if own.mesh.face_uvs is None else own.mesh.face_uvs[skin]
    )
    wrong = atlas.faults(skin_mesh)
    if not wrong:
        return own, "the artist's"
    if not allowed:
        raise Problem(
            f"Maps cannot be baked into the UVs of {own.path.name}. {' '.join(wrong)}",
            "Unwrap the mesh in your modelling program, or switch on New Atlas under Reconstruction, Head "
            "Mesh (--new-atlas).",
        )
    return replace(own, mesh=atlas.unwrap(own.mesh, size), new_atlas=True), "a new atlas"


def write(path: Path, own: OwnMesh, vertices: np.ndarray) -> None:
    """Write the artist's file with vertices [V, 3] in metres: same order, polygons, groups and UVs.

    A UV line is copied, not rewritten. With a new atlas, polygons that a seam crosses are cut into triangles. Normals
    and the material library are left out: the first no longer hold, the second lies elsewhere.
    """
    text = own.path.read_text(encoding="utf-8", errors="replace").replace("\\\n", " ")
    lines, vertex, triangle = [], 0, 0
    uv_lines = [f"vt {u:.6f} {v:.6f}" for u, v in own.mesh.uvs] if own.new_atlas else []
    for line in text.splitlines():
        words = line.split()
        key = words[0] if words else ""
        if key == "v":
            lines.append("v " + " ".join([*(f"{x:.6f}" for x in vertices[vertex]), *words[4:]]))
            vertex += 1
        elif key == "f" and not own.new_atlas:
            lines.append("f " + " ".join("/".join(corner.split("/")[:2]).rstrip("/") for corner in words[1:]))
        elif key == "f":
            if uv_lines:
                lines, uv_lines = [*lines, *uv_lines], []
            count = len(words) - 3
            lines += _polygons(
                own.mesh.faces[triangle : triangle + count] + 1, own.mesh.face_uvs[triangle : triangle + count] + 1
            )
            triangle += count
        elif key not in ("vn", "mtllib") and not (own.new_atlas and key == "vt"):
            lines.append(line)
    with replacing(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _polygons(faces: np.ndarray, uvs: np.ndarray) -> list[str]:
    """Return face lines of one polygon's triangles: one line if its corners have one UV each, else the triangles."""
    corner = {}
    for v, t in zip(faces.ravel(), uvs.ravel(), strict=True):
        if corner.setdefault(int(v), int(t)) != t:
            return [f"f {a}/{i} {b}/{j} {c}/{k}" for (a, b, c), (i, j, k) in zip(faces, uvs, strict=True)]
    ring = [int(faces[0, 0]), *(int(f[1]) for f in faces), int(faces[-1, 2])]  # the fan's first corner, then its rim
    return ["f " + " ".join(f"{v}/{corner[v]}" for v in ring)]


def _folder(folder: Path) -> tuple[Path, list[Path]]:
    """Return the neutral mesh of a folder (or of the one folder of OBJs within it) and its shapes, identity first."""
    inside = [folder, *sorted(p for p in folder.iterdir() if p.is_dir())]
    for place in inside:
        objs = sorted(p for p in place.glob("*") if p.suffix.lower() == ".obj")
        neutral = [p for p in objs if "neutral" in p.stem.lower()]
        if len(neutral) == 1:
            shapes = sorted((p for p in objs if p != neutral[0]), key=lambda p: (not _is_identity(p), _numbers(p)))
            expressions = sum(not _is_identity(p) for p in shapes)
            identities = shapes[: len(shapes) - expressions][: max(MOST_SHAPES - expressions, MOST_SHAPES // 2)]
            return neutral[0], [*identities, *shapes[len(shapes) - expressions :]][:MOST_SHAPES]
    raise Problem(
        f"{folder} holds no head mesh: there is not exactly one OBJ with 'neutral' in its name.",
        "Choose a folder with a neutral mesh and its shapes, or one OBJ file.",
    )


def _is_identity(path: Path) -> bool:
    return path.stem.lower().startswith("identity")


def _numbers(path: Path) -> list:
    return [int(token) if token.isdigit() else token for token in re.split(r"(\d+)", path.stem.lower())]


def _positions(path: Path) -> np.ndarray:
    """Read the vertices [V, 3] of an OBJ, without its faces."""
    try:
        return meshes.read_obj_vertices(path)
    except Problem as problem:
        raise Problem(
            f"The shape {path.name} cannot be read: {problem.problem}", "Export it again, or take it out of the folder."
        ) from problem


def _check(mesh: Mesh, path: Path) -> None:
    """Refuse a mesh that cannot be a head.

    Raises Problem.
    """
    count = len(mesh.vertices)
    if np.ptp(mesh.vertices, axis=0).min() <= 0:
        raise Problem(f"{path.name} is flat.", "Export it again as OBJ.")
    if not LEAST_VERTICES <= count <= MOST_VERTICES:
        raise Problem(
            f"{path.name} has {count} vertices.",
            f"Choose a head with {LEAST_VERTICES} to {MOST_VERTICES} vertices, neither a primitive nor a "
            "sculpt at its highest level.",
        )
