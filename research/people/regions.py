# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of the face as smooth weights in [0, 1] around landmarks, and the curves along which skin creases.

Numbers are MediaPipe face-mesh landmarks, (right, left) of the person; distances are millimetres on an adult head.
"""

from __future__ import annotations

import cv2
import numpy as np

from .canvas import Canvas

JAW = [132, 58, 172, 136, 150, 149, 176, 148, 152, 377, 400, 378, 379, 365, 397, 288, 361]
MOUSTACHE = [92, 165, 167, 164, 393, 391, 322]
# fmt: off
LOWER_CHEEK = [
    214, 434, 192, 416, 213, 433, 147, 376, 135, 364, 169, 394, 210, 430, 211, 431, 138, 367, 215, 435, 177, 401,
]
# fmt: on
GOATEE = [18, 200, 199, 201, 421, 204, 424, 202, 422, 212, 432, 57, 287, 43, 273, 83, 313]
LIDS = [33, 7, 163, 144, 145, 153, 154, 155, 133], [362, 382, 381, 380, 374, 373, 390, 249, 263]
SIDEBURNS = [127, 234, 93, 356, 454, 323]
BLOBS = {  # name -> (landmark, radius in mm) ...
    "cheeks": [(50, 14), (205, 13), (280, 14), (425, 13)],
    "nose": [(4, 9), (5, 8), (98, 6), (327, 6), (195, 6), (220, 6), (440, 6)],
    "chin": [(199, 11), (152, 10)],
    "forehead": [(151, 20), (9, 12), (108, 20), (337, 20), (10, 16)],
    "under_eyes": [(230, 6), (231, 6), (229, 6), (450, 6), (451, 6), (449, 6)],
    "eyelids": [(159, 6), (158, 6), (160, 6), (145, 4), (386, 6), (385, 6), (387, 6), (374, 4), (133, 4), (362, 4)],
    "sockets": [(224, 7), (222, 7), (189, 6), (444, 7), (442, 7), (413, 6)],
    "mouth_surround": [(164, 6), (18, 6), (57, 6), (287, 6)],
}


def regions(on: Canvas) -> dict[str, np.ndarray]:
    """Return weights float32 [N] by name.

    The BLOBS, the template's masks softened at their edges, beard, oily (T-zone), bald (bare of long hair).
    """
    if not on.cache:
        for name, blobs in BLOBS.items():
            on.cache[name] = on.soft(lambda points, blobs=blobs: _blobs(points, on.landmarks, blobs))
        for name, radius in (("lips", 0.7), ("brows", 1.5), ("ears", 4.0), ("neck", 12.0), ("scalp", 8.0)):
            on.cache[name] = _softened(on, name, radius)
        chin_down = np.array([0, 14.0, -22.0])
        beard = on.soft(
            lambda points: (
                1
                - (1 - 0.95 * _around(points, on.landmarks[JAW], 14))
                * (1 - _around(points, on.landmarks[MOUSTACHE], 5.5))
                * (1 - 0.95 * _around(points, on.landmarks[GOATEE], 7))
                * (1 - 0.8 * _around(points, on.landmarks[SIDEBURNS], 8))
                * (1 - 0.9 * _around(points, on.landmarks[LOWER_CHEEK], 8))
                * (1 - 0.85 * _around(points, on.landmarks[JAW[3:-3]] + chin_down, 16))
            )
        )
        on.cache["beard"] = beard * (1 - on.cache["lips"]) * (1 - on.cache["ears"]) * (1 - on.cache["scalp"])
        on.cache["oily"] = np.clip(on.cache["nose"] + 0.8 * on.cache["forehead"] + 0.5 * on.cache["chin"], 0, 1)
        on.cache["bald"] = (1 - np.clip(on.cache["scalp"] + on.cache["brows"], 0, 1)) * (1 - on.cache["lips"])
    return on.cache


def creases(on: Canvas, rng: np.random.Generator) -> list[tuple[np.ndarray, float, float, float]]:
    """Return the folds of an ageing face.

    Each is (curve [M, 3] in mm, width in mm, depth in mm at a great age, age in years at which it begins).
    """
    at = on.landmarks
    lines: list[tuple[np.ndarray, float, float, float]] = []

    def add(points: np.ndarray, width: float, depth: float, begins: float) -> None:
        curve = _curve(points + rng.normal(0, 1.2, points.shape) * [1, 0, 1])
        width, depth = width * rng.uniform(0.8, 1.3), depth * rng.uniform(0.6, 1.4)
        lines.append((curve, width, depth, begins + rng.normal(0, 6)))

    low, high = at[[70, 105, 107, 9, 336, 334, 300]], at[[54, 103, 109, 10, 338, 332, 284]]
    for share in (0.25, 0.45, 0.65, 0.85):  # across the forehead
        add(low + share * (high - low), 1.6, 0.25, 34)
    for side in ((129, 203, 206, 216, 212), (358, 423, 426, 436, 432)):  # beside the nose and mouth
        add(at[list(side)], 2.4, 0.35, 30)
    for side in ((61, 202, 204), (291, 422, 424)):  # below the corners of the mouth
        add(at[list(side)], 2.0, 0.25, 45)
    for side in ((107, 55, 193), (336, 285, 417)):  # between the brows
        add(at[list(side)] + [0, 0, 2], 1.4, 0.25, 38)
    for side in ((243, 112, 230, 229, 228), (463, 341, 450, 449, 448)):  # below the eyes
        add(at[list(side)], 1.2, 0.18, 28)
        add(at[list(side)] + [0, 0, -3.5], 1.2, 0.15, 42)
    for outer, sign in ((33, -1.0), (263, 1.0)):  # crow's feet
        for angle in (-0.5, -0.15, 0.2, 0.5):
            way = np.linspace(5, 19, 4)[:, None]
            add(at[outer] + way * [sign * np.cos(angle), 0.75, np.sin(angle)], 1.0, 0.18, 36)
    return lines


def lid_lines(on: Canvas) -> np.ndarray:
    """Return points [M, 3] in mm along the lower lids' rims, where the lids meet."""
    return np.concatenate([_curve(on.landmarks[side]) for side in LIDS])


def _blobs(points: np.ndarray, landmarks: np.ndarray, blobs: list[tuple[int, float]]) -> np.ndarray:
    """Return one minus the product of what each Gaussian leaves, [M]."""
    remainder = np.ones(len(points), np.float32)
    for landmark, radius in blobs:
        remainder *= 1 - _gaussian(points, landmarks[landmark], radius)
    return 1 - remainder


def _around(points: np.ndarray, centres: np.ndarray, radius: float) -> np.ndarray:
    return np.max([_gaussian(points, centre, radius) for centre in centres], axis=0)


def _gaussian(points: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray:
    square = ((points - centre.astype(np.float32)) ** 2).sum(-1)
    return np.exp(-0.5 * square / np.float32(radius * radius))


def _softened(on: Canvas, name: str, radius: float) -> np.ndarray:
    """Blur a mask by `radius` mm (a mean over the charts' scale), the charts' outside not counted."""
    sigma = radius / on.texel_mm
    picture = np.zeros((on.size, on.size), np.float32)
    picture[on.covered] = on.masks[name]
    weight = cv2.GaussianBlur(on.covered.astype(np.float32), (0, 0), sigma)
    return (cv2.GaussianBlur(picture, (0, 0), sigma) / np.maximum(weight, 1e-6))[on.covered]


def _curve(points: np.ndarray, step: float = 0.4) -> np.ndarray:
    """Sample a Catmull-Rom curve through points [P, 3] in mm about every `step` mm."""
    padded = np.concatenate([2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]])
    pieces = []
    for a, b, c, d in zip(padded[:-3], padded[1:-2], padded[2:-1], padded[3:], strict=True):
        t = np.linspace(0, 1, max(2, int(np.linalg.norm(c - b) / step)), endpoint=False)[:, None]
        pieces.append(b + 0.5 * t * ((c - a) + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a))))
    return np.concatenate([*pieces, points[-1:]])
