# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Built-in head: mesh with its frozen UVs, identity space, landmarks and UV masks.

research/people/base_head/build.py made the files.
"""

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
    """Return the neutral head.

    Metres, pupils 63 mm apart, +Z up, face towards -Y, u = 0.5 in the middle, the person's left at u > 0.5.
    """
    return meshes.read_obj(_shipped("head.obj"))


@cache
def identity() -> np.ndarray:
    """Return displacements float32 [K, V, 3] in metres per unit coefficient.

    Coefficients are independent and N(0, 1) over MakeHuman's heads.
    """
    with np.load(_shipped("identity.npz"), allow_pickle=False) as stored:
        return stored["components"].astype(np.float32)


@cache
def mirrored_vertices() -> np.ndarray:
    """Return the vertex on the other side of the face, int64 [V].

    In the UVs that is u and 1 - u, exactly, but on the seam behind.
    """
    vertices = load().vertices
    return cKDTree(vertices).query(vertices * [-1, 1, 1])[1]


@cache
def landmarks() -> tuple[np.ndarray, np.ndarray]:
    """Return triangle int64 [468] and barycentric coordinates float64 [468, 3] of the MediaPipe landmarks."""
    record = _record()["landmarks"]
    return np.array(record["face"]), np.array(record["bary"])


def landmark_points(head: Mesh) -> np.ndarray:
    """Return the 468 landmarks [468, 3] on a head of the built-in topology."""
    return at_landmarks(head.vertices)


def at_landmarks(vertex_values: np.ndarray) -> np.ndarray:
    """Interpolate values of the vertices [..., V, C] at the landmarks [..., 468, C]."""
    face, bary = landmarks()
    return (vertex_values[..., load().faces[face], :] * bary[..., None]).sum(-2)


@cache
def landmark_weights() -> np.ndarray:
    """Return the trust in each landmark, 0 to 1 [468].

    0 where the network places it elsewhere from every side.
    """
    return np.array(_record()["landmarks"]["weight"])


@cache
def mask(name: str, size: int) -> np.ndarray:
    """Return a soft UV mask of MASKS, float32 [size, size] in [0, 1]; it is shared: copy before writing."""
    assert name in MASKS, name
    return images.resize(images.read_mask(_shipped(f"masks/{name}.png")), size, size).clip(0, 1)


def template_hash(mesh: Mesh) -> str:
    """Hash topology and UVs (to 1e-6), which every shipped weight depends on; positions do not count."""
    digest = hashlib.blake2b(digest_size=16)
    for array in (mesh.faces, mesh.face_uvs, np.round(mesh.uvs * 1e6)):
        digest.update(np.ascontiguousarray(array, np.int64).tobytes())
    return digest.hexdigest()


def is_built_in(mesh: Mesh) -> bool:
    """Return True if a mesh has this head's topology and UVs, so that its masks hold for it."""
    return mesh.uvs is not None and template_hash(mesh) == _record()["hash"]


@cache
def _record() -> dict:
    return json.loads(_shipped("head.json").read_text(encoding="utf-8"))


def _shipped(name: str) -> Path:
    """Return a file of the assets.

    Raises Problem where it is missing or damaged.
    """
    shipped_files.require_whole(ASSETS / name)
    return ASSETS / name
