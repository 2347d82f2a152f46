# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a beard grows: told from bare skin by how many dark strokes a picture of it shows, where beards grow.

Two rooms need it: what a beard darkens is no shadow (solve), and hair is groomed over clean skin (upscale).
"""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np

from ..geometry import raster
from ..imaging import images
from . import template

PLACES_MM = (
    ((132, 58, 172, 136, 150, 149, 176, 148, 152, 377, 400, 378, 379, 365, 397, 288, 361), 16.0),
    ((92, 165, 167, 164, 393, 391, 322), 6.5),
    ((18, 200, 199, 201, 421, 204, 424, 202, 422, 212, 432, 57, 287), 9.0),
    ((127, 234, 93, 356, 454, 323), 8.0),
    ((214, 434, 192, 416, 213, 433, 147, 376, 135, 364, 169, 394, 210, 430, 138, 367), 10.0),
)
"""MediaPipe landmarks about which a beard grows, and how far in mm: jaw, upper lip, chin, before the ears, lower
cheeks."""
BELOW_JAW_MM = (0.0, 14.0, -22.0), 18.0
"""mm from the jaw to where the beard goes on below it, and how far it reaches there."""
ZONE_STEP_TEXELS = 4
"""Every so many texels the beard's zone, which is soft, is worked out."""
OUTSTANDING_DEVIATIONS = 2.5
"""Deviations of the bare skin's grain above which a texel is a dark stroke."""
AROUND_MM = 0.5
"""mm about a stroke that count as stroked: many hairs tell a beard, not one long edge of a shadow."""
STROKED_SHARES = 0.10, 0.25
"""Share of the skin that is stroked, beyond the bare skin's own, at which a beard begins, and from which on there is
one."""
MIN_BEARD_SHARE = 0.10
"""Share of where a beard may grow that must have one: less is freckles, scars or the edges of shadows."""
SIZE_TEXELS = 1024
"""Texels of a map that shows single strokes: a hair is about half of one wide."""


def seen_in(texture: np.ndarray, confidence: np.ndarray) -> np.ndarray:
    """How sure it is that a beard grows here, float32 [SIZE_TEXELS, SIZE_TEXELS] in [0, 1], from a texture of the
    built-in head.

    texture linear [S, S, 3]; confidence [S, S]: how well each texel was seen. Zero everywhere where the texture is too
    small to show strokes.
    """
    if len(texture) < SIZE_TEXELS:
        return np.zeros((SIZE_TEXELS, SIZE_TEXELS), np.float32)
    light = np.log(np.maximum(images.resize(texture, SIZE_TEXELS, SIZE_TEXELS), 1e-3)).mean(-1).astype(np.float32)
    grows, texel = _on_template()
    elsewhere = (grows < 0.05) & (template.mask("brows", SIZE_TEXELS) < 0.01)
    bare = (
        (template.mask("skin", SIZE_TEXELS) > 0.99)
        & elsewhere
        & (images.resize(confidence, SIZE_TEXELS, SIZE_TEXELS) > 0.5)
    )
    small = fine(light, float(np.median(texel)))
    return presence(small, deviation(small[bare]), bare, grows, texel)


def zone(landmarks: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Where a beard may grow, float32 [S, S] in [0, 1]. landmarks [468, 3], position [S, S, 3] in mm."""
    near = [(landmarks[list(which)], radius) for which, radius in PLACES_MM]
    near.append((landmarks[list(PLACES_MM[0][0])] + BELOW_JAW_MM[0], BELOW_JAW_MM[1]))
    coarse = np.ascontiguousarray(
        position[ZONE_STEP_TEXELS // 2 :: ZONE_STEP_TEXELS, ZONE_STEP_TEXELS // 2 :: ZONE_STEP_TEXELS]
    )
    out, size = np.zeros(coarse.shape[:2], np.float32), len(position)
    for centres, radius in near:
        for centre in centres:
            np.maximum(
                out,
                np.clip(1.8 - ((coarse - centre.astype(np.float32)) ** 2).sum(-1) / np.float32(radius**2), 0, 1),
                out=out,
            )
    bar = np.maximum.reduce([template.mask(name, size) for name in ("lips", "ears", "scalp", "nostrils", "nose")])
    return cv2.resize(out, (size, size), interpolation=cv2.INTER_LINEAR) * (1 - bar)


def presence(small: np.ndarray, usual: float, bare: np.ndarray, grows: np.ndarray, texel: np.ndarray) -> np.ndarray:
    """How sure it is that a beard grows here, from the share of dark strokes around.

    Parameters
    ----------
    small : [S, S], `fine` of the log albedo
    usual : its `deviation` on bare skin
    bare : bool [S, S], skin without hair
    grows : [S, S] in [0, 1], `zone`
    texel : [S, S], width of each texel in mm

    Returns
    -------
    float32 [S, S] in [0, 1].
    """
    width = float(np.median(texel))
    stroked = cv2.dilate((small < -OUTSTANDING_DEVIATIONS * usual).astype(np.float32), disc(AROUND_MM / width))
    around = cv2.GaussianBlur(stroked, (0, 0), 4.0 / width)
    own = np.percentile(around[bare], 75) if bare.any() else 0.0
    confidence = np.clip((around - own - STROKED_SHARES[0]) / (STROKED_SHARES[1] - STROKED_SHARES[0]), 0, 1) * grows
    if float((confidence * texel**2).sum()) < MIN_BEARD_SHARE * float((grows * texel**2).sum()):
        return np.zeros_like(grows)
    return confidence.astype(np.float32)


def fine(light: np.ndarray, texel: float) -> np.ndarray:
    """What of a picture [S, S] is finer than about 1.5 mm; a texel is `texel` mm wide."""
    return light - cv2.GaussianBlur(light, (0, 0), 0.8 / texel)


def deviation(samples: np.ndarray) -> float:
    """Of most samples [N]: what stands out does not count."""
    return float(1.4826 * np.median(np.abs(samples - np.median(samples)))) if len(samples) else 0.05


def disc(radius: float) -> np.ndarray:
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * max(1, round(radius)) + 1,) * 2)


@cache
def _on_template() -> tuple[np.ndarray, np.ndarray]:
    """`zone` and the width of each texel in mm [SIZE_TEXELS, SIZE_TEXELS] on the built-in head before it is fitted:
    near enough for what is soft by millimetres."""
    mesh, (face, bary) = template.load(), raster.rasterize_uv(template.load(), SIZE_TEXELS)
    at, weight = template.landmarks()
    landmarks = 1000 * (mesh.vertices[mesh.faces[at]] * weight[..., None]).sum(1)
    position = raster.bleed(
        raster.interpolate(1000 * mesh.vertices, mesh.faces, face, bary).astype(np.float32), face >= 0
    )
    width = np.sqrt(np.linalg.norm(np.cross(*(np.gradient(position, axis=axis) for axis in (0, 1))), axis=-1))
    return zone(landmarks, position), np.minimum(width, 3 * np.median(width))
