# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions where a beard grows, told from bare skin by the density of dark strokes in a picture.

Two rooms need it: what a beard darkens is no shadow (solve), and hair is groomed over clean skin (upscale).
"""

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
"""MediaPipe landmarks around which a beard grows, and its reach in mm: jaw, upper lip, chin, sideburns, lower
cheeks."""
BELOW_JAW_MM = (0.0, 14.0, -22.0), 18.0  # offset in mm from the jaw to the beard below it, and its reach there
ZONE_STEP_TEXELS = 4  # texels between the samples of the beard's zone, which is soft
OUTSTANDING_DEVIATIONS = 2.5  # deviations of the bare skin's grain beyond which a texel is a dark stroke
AROUND_MM = 0.5
"""Radius in mm around a stroke that counts as stroked: many hairs make a beard, the long edge of one shadow does
not."""
STROKED_SHARES = 0.10, 0.25
"""Shares of stroked skin, beyond that of bare skin, at which a beard begins and from which it is certain."""
MIN_BEARD_SHARE = 0.10  # minimum share of the zone that must have a beard: less is freckles, scars or edges of shadows
SIZE_TEXELS = 1024  # side of a map that resolves single strokes: a hair is about half a texel wide


def seen_in(texture: np.ndarray, confidence: np.ndarray) -> np.ndarray:
    """Return the certainty of a beard, float32 [SIZE_TEXELS, SIZE_TEXELS] in [0, 1], in a texture of the built-in head.

    texture [S, S, 3] is linear; confidence [S, S] says how well each texel was seen. Zero where the texture is too
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
    """Return where a beard may grow, float32 [S, S] in [0, 1], for landmarks [468, 3] and position [S, S, 3] in mm."""
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
    """Return the certainty of a beard, float32 [S, S] in [0, 1], from the share of dark strokes nearby.

    small is `fine` of the log albedo and usual its `deviation` on bare skin, which bare [S, S] marks; grows is the
    `zone`; texel is the width of each texel in mm.
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
    """Keep only details of a picture [S, S] finer than about 1.5 mm; a texel is `texel` mm wide."""
    return light - cv2.GaussianBlur(light, (0, 0), 0.8 / texel)


def deviation(samples: np.ndarray) -> float:
    """Return a robust standard deviation of samples [N]."""
    return float(1.4826 * np.median(np.abs(samples - np.median(samples)))) if len(samples) else 0.05


def disc(radius: float) -> np.ndarray:
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * max(1, round(radius)) + 1,) * 2)


@cache
def _on_template() -> tuple[np.ndarray, np.ndarray]:
    """Return `zone` and the width in mm of each texel [SIZE_TEXELS, SIZE_TEXELS] on the unfitted built-in head.

    It is near enough for what is soft by millimetres.
    """
    mesh, (face, bary) = template.load(), raster.rasterize_uv(template.load(), SIZE_TEXELS)
    landmarks = 1000 * template.landmark_points(mesh)
    position = raster.bleed(
        raster.interpolate(1000 * mesh.vertices, mesh.faces, face, bary).astype(np.float32), face >= 0
    )
    width = np.sqrt(np.linalg.norm(np.cross(*(np.gradient(position, axis=axis) for axis in (0, 1))), axis=-1))
    return zone(landmarks, position), np.minimum(width, 3 * np.median(width))
