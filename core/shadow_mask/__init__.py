# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A first proposal of the shadow mask M, in UV: what the delighter saw shaded, and what is still dark in I_UV.

Writes shadow_mask_auto.png only (8 bit grey, soft edges); shadow_mask.png is the artist's and is never touched.
"""

from __future__ import annotations

import numpy as np

from .. import images, meshes, template
from ..capture import Capture
from ..meshes import Mesh
from ..messages import Reporter
from ..raster import interpolate, rasterize_uv
from ..settings import Settings
from .lift import lift_shadows
from .residual import find_shadow
from .tidy import cohere, tidy

WORKING_SIZE = 512
SEEN = 0.05  # least confidence of a texel that is judged


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """texture.exr, texture_confidence.exr, head.obj and delit/shadow -> shadow_mask_auto.png at the texture's size."""
    texture = images.read_linear(capture.texture)
    confidence = images.read_data(capture.texture_confidence)[..., 0]
    head = meshes.read_obj(capture.head)
    size = len(texture)
    work = min(WORKING_SIZE, size)
    report.progress(0, 4, "Unfolding the head")
    face, bary = rasterize_uv(head, work)
    small = images.resize(texture, work, work)
    judged = (face >= 0) & (images.resize(confidence, work, work) > SEEN) & (_region(head, "face", work) > 0.5)
    lifted = lift_shadows(capture, head, face, bary, report)
    still, residual, step = propose(small, _normals(head, face, bary), judged, _region(head, "skin", work) * (1 - _region(head, "eyes", work)) > 0.5,
                                    settings.shadow_mask.sensitivity)
    threshold = 0.75 - 0.5 * settings.shadow_mask.sensitivity
    mask = tidy((still | (lifted > threshold)) & judged, judged, settings.shadow_mask.dilate_px * work / 1024)
    images.write_data(capture.shadow_mask_auto, np.clip(images.resize(mask, size, size), 0, 1))

    report.figure("masked_percent", round(100 * float(mask[judged].mean()) if judged.any() else 0.0, 1))
    report.figure("seen_in_frames_percent", round(100 * float((lifted > threshold)[judged].mean()) if judged.any() else 0.0, 1))
    report.figure("left_in_texture_percent", round(100 * float(still[judged].mean()) if judged.any() else 0.0, 1))
    report.figure("threshold_log", round(float(step.mean()) / 2, 3))
    shown = np.repeat(np.clip(0.5 + residual.mean(-1) / 2, 0, 1)[..., None], 3, -1) * judged[..., None]
    images.write_srgb(capture.picture("shadow_mask", "texture_residual_mask"),
                      np.hstack([images.linear_to_srgb(small), shown.astype(np.float32), np.repeat(mask[..., None], 3, -1)]))


def propose(texture: np.ndarray, normals: np.ndarray, judged: np.ndarray, skin: np.ndarray, sensitivity: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Linear texture and unit normals [S, S, 3]; bool [S, S]: texels to judge, and those of plain skin (lips, brows and the like are dark by themselves).

    Returns the shadow still in the texture bool [S, S], the residual against lit skin [S, S, 3] in log units, and the shadow's colour [3] in log units.
    """
    odds, residual = np.full(judged.shape, -12.0), np.zeros(texture.shape)
    found, deviation, step = find_shadow(texture[judged], normals[judged], skin[judged])
    odds[judged], residual[judged] = found, deviation
    if not step.any():
        return np.zeros_like(judged), residual, step
    odds = np.where(skin, np.clip(odds + 6 * (sensitivity - 0.5), -12, 12), 0)  # what is not skin follows its neighbours
    return cohere(odds, judged), residual, step


def _normals(head: Mesh, face: np.ndarray, bary: np.ndarray) -> np.ndarray:
    normals = interpolate(meshes.vertex_normals(head), head.faces, face, bary)
    return normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-9)


def _region(head: Mesh, name: str, size: int) -> np.ndarray:
    """A UV mask of the template [S, S]; on a head of another topology everything is face and skin."""
    if head.faces.shape == template.load().faces.shape:
        return template.mask(name, size)
    return np.full((size, size), float(name in ("face", "skin")), np.float32)
