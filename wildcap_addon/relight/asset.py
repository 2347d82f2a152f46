# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mark WildCap Skin as an asset with tags, a preview and a catalogue, so that an asset library offers it."""

import contextlib
from pathlib import Path

import bpy
import numpy as np

from ...core.capture.files import replacing
from ...core.capture.messages import Problem

CATALOGUE = "6c1f7a52-8e0d-4f6b-9b7e-3d5a0c94e217"
LINE = f"{CATALOGUE}:WildCap/Skin:WildCap-Skin"
FILE = "blender_assets.cats.txt"
HEADER = "# This is an Asset Catalog Definition file for Blender.\n\nVERSION 1\n\n"
SIDE_PX = 128
"""Side of the preview."""
DESCRIPTION = "Skin for solved heads: albedo, specular and normal in, a Principled BSDF with subsurface scattering out"


def mark(group: bpy.types.NodeTree) -> None:
    """Mark the group as an asset, once: an artist may clear the mark.

    An asset library of the preferences that contains the .blend gets the catalogue.
    """
    if not group.get("wildcap_asset"):
        group["wildcap_asset"] = True
        group.asset_mark()
        data = group.asset_data
        data.description, data.catalog_id = DESCRIPTION, CATALOGUE
        data.author, data.license = "WildCap for Blender", "GPL-3.0-or-later"
        for tag in ("skin", "head", "relight"):
            data.tags.new(tag, skip_if_exists=True)
        preview = group.preview_ensure()
        preview.image_size = (SIDE_PX, SIDE_PX)
        preview.image_pixels_float.foreach_set(ball().ravel())
    if group.asset_data is not None:
        _name_catalogue()


def ball() -> np.ndarray:
    """Draw the preview, as there is not always a window: a ball of skin under one lamp.

    sRGB with alpha, float32 [SIDE_PX, SIDE_PX, 4], rows from the bottom.
    """
    y, x = (np.mgrid[:SIDE_PX, :SIDE_PX] + 0.5) / SIDE_PX * 2.2 - 1.1
    inside = np.hypot(x, y)
    normal = np.stack([x, y, np.sqrt(np.clip(1 - inside**2, 0, None))], -1)
    lamp = np.array([-0.5, 0.6, 0.65]) / np.linalg.norm([-0.5, 0.6, 0.65])
    cosine = (normal @ lamp)[..., None]
    wrap = np.array([0.35, 0.15, 0.08])  # subsurface light reddens the shadow's edge
    diffuse = np.array([0.58, 0.36, 0.27]) * (0.06 + 0.9 * np.clip((cosine + wrap) / (1 + wrap), 0, None))
    half = (lamp + [0, 0, 1]) / np.linalg.norm(lamp + [0, 0, 1])
    linear = np.clip(diffuse + 0.3 * np.clip(normal @ half, 0, 1)[..., None] ** 40, 0, 1)
    alpha = np.clip((1 - inside) * SIDE_PX / 2.2, 0, 1)[..., None]
    return np.concatenate([linear ** (1 / 2.2), alpha], -1).astype(np.float32)


def _name_catalogue() -> None:
    if not bpy.data.filepath:
        return
    for library in bpy.context.preferences.filepaths.asset_libraries:
        file = Path(bpy.path.abspath(library.path)) / FILE
        if library.path and Path(bpy.data.filepath).is_relative_to(file.parent):
            # a library that is read-only keeps the asset without a catalogue
            with contextlib.suppress(OSError, Problem, UnicodeDecodeError):
                catalogues = file.read_text(encoding="utf-8") if file.is_file() else HEADER
                if CATALOGUE not in catalogues:
                    with replacing(file) as temporary:
                        temporary.write_text(catalogues.rstrip("\n") + f"\n{LINE}\n", encoding="utf-8")
