# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The built-in head: mesh with its frozen UVs, identity space, landmarks and UV masks.
research/people/base_head/build.py made the files."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from ..capture import shipped_files
from ..geometry import meshes
from ..geometry.meshes import Mesh
from ..imaging import images

ASSETS = Path(__file__).parents[1] / "assets"
DATA_FILES = ("assets/head.obj", "assets/head.json", "assets/identity.npz", "assets/masks")
MASKS = ("face", "skin", "lips", "brows", "eyes", "nose", "nostrils", "ears", "neck", "scalp")


@cache
def load() -> Mesh:
    """The neutral head: metres, pupils 63 mm apart, +Z up, face towards -Y, u = 0.5 in the middle, the person's left at
    u > 0.5."""
    return meshes.read_obj(_shipped("head.obj"))


@cache
def identity() -> np.ndarray:
    """Displacements float32 [K, V, 3] in metres per unit coefficient; coefficients are independent and N(0, 1) over
    MakeHuman's heads."""
    with np.load(_shipped("identity.npz"), allow_pickle=False) as stored:
        return stored["components"].astype(np.float32)


@cache
def mirrored_vertices() -> np.ndarray:
    """int64 [V]: the vertex on the other side of the face. In the UVs that is u and 1 - u, exactly, but on the seam
    behind."""
    vertices = load().vertices
    return cKDTree(vertices).query(vertices * [-1, 1, 1])[1]


@cache
def landmarks() -> tuple[np.ndarray, np.ndarray]:
    """Where the 468 MediaPipe landmarks lie: triangle int64 [468] and barycentric coordinates float64 [468, 3]."""
    record = _record()["landmarks"]
    return np.array(record["face"]), np.array(record["bary"])


def landmark_points(head: Mesh) -> np.ndarray:
    """The 468 landmarks [468, 3] on a head of the built-in topology."""
    face, bary = landmarks()
    return (head.vertices[head.faces[face]] * bary[..., None]).sum(1)


@cache
def landmark_weights() -> np.ndarray:
    """How far each landmark can be trusted, 0 to 1 [468]; 0 where the net places it elsewhere from every side."""
    return np.array(_record()["landmarks"]["weight"])


@cache
def mask(name: str, size: int) -> np.ndarray:
    """A soft UV mask float32 [size, size] in [0, 1]; `name` is one of MASKS. The array is shared: copy before
    writing."""
    assert name in MASKS, name
    return images.resize(images.read_mask(_shipped(f"masks/{name}.png")), size, size).clip(0, 1)


def template_hash(mesh: Mesh) -> str:
    """Hash of topology and UVs (to 1e-6), which every shipped weight depends on; positions do not count."""
    digest = hashlib.blake2b(digest_size=16)
    for array in (mesh.faces, mesh.face_uvs, np.round(mesh.uvs * 1e6)):
        digest.update(np.ascontiguousarray(array, np.int64).tobytes())
    return digest.hexdigest()


def is_built_in(mesh: Mesh) -> bool:
    """Whether a mesh has this head's topology and UVs, so that its masks hold for it."""
    return mesh.uvs is not None and template_hash(mesh) == _record()["hash"]


@cache
def _record() -> dict:
    return json.loads(_shipped("head.json").read_text(encoding="utf-8"))


def _shipped(name: str) -> Path:
    """A file of the assets. Raises Problem where it is missing or damaged."""
    shipped_files.require_whole(ASSETS / name)
    return ASSETS / name
