# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Roughness of the head's regions relative to the cheeks, as a vertex attribute, which stays with the mesh."""

from functools import cache
from pathlib import Path

import bpy
import numpy as np

from ...core.capture import skin_regions
from ..data_blocks import load_pixels, read_field

ATTRIBUTE = "wildcap_roughness"
MASKS = Path(__file__).resolve().parents[2] / "core" / "assets" / "masks"
STEP_TEXELS = 4
"""Every fourth texel of the masks' 1024 is finer than the mesh."""
SHARES = skin_regions.ROUGHNESS
"""Region -> roughness relative to the cheeks, minus 1; later ones win where they meet."""


def write(mesh: bpy.types.Mesh) -> None:
    """Write the attribute of a mesh with the built-in head's UVs: 0 is the cheeks' roughness, -0.2 a fifth less."""
    shares = _shares()
    uvs = read_field(mesh.uv_layers[0].data, "uv", 2)
    texel = np.clip((uvs * len(shares)).astype(int), 0, len(shares) - 1)
    roughness = np.zeros(len(mesh.vertices), np.float32)
    roughness[read_field(mesh.loops, "vertex_index", kind=np.int32)] = shares[texel[:, 1], texel[:, 0]]
    attribute = mesh.attributes.get(ATTRIBUTE)
    if attribute is not None and (attribute.domain, attribute.data_type) != ('POINT', 'FLOAT'):
        mesh.attributes.remove(attribute)
        attribute = None
    if attribute is None:
        attribute = mesh.attributes.new(ATTRIBUTE, 'FLOAT', 'POINT')
    attribute.data.foreach_set("value", roughness)


def in_face(mesh: bpy.types.Mesh) -> np.ndarray:
    """Return which polygons [P] of a mesh with the built-in head's UVs are in the face."""
    mask = load_pixels(MASKS / "face.png")[..., 0]
    uvs = read_field(mesh.uv_layers[0].data, "uv", 2)[read_field(mesh.polygons, "loop_start", kind=np.int32)]
    texel = np.clip((uvs * len(mask)).astype(int), 0, len(mask) - 1)
    return mask[texel[:, 1], texel[:, 0]] > 0.5


@cache
def _shares() -> np.ndarray:
    """Return the attribute as a map [S, S], rows from the bottom as v goes."""
    masks = {
        name: load_pixels(MASKS / f"{name}.png")[::STEP_TEXELS, ::STEP_TEXELS, 0]
        for name in ("face", "brows", "neck", "ears", "scalp", "nose", "eyes", "lips")
    }
    rows = np.arange(len(masks["face"]))
    brows_end = np.flatnonzero(masks["brows"].max(1) > 0.5).max()
    above = np.clip((rows - brows_end) / (skin_regions.FOREHEAD_FADE * len(rows)), 0, 1)
    masks["forehead"] = masks["face"] * above[:, None]
    result = np.zeros_like(masks["face"])
    for name, share in SHARES.items():
        result += masks[name] * (share - result)
    return result
