# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Face cut out of a frame, upright, by FFHQ's alignment by eyes and mouth (Karras et al. 2019), and put back.

Maps [2, 3] go from frame to crop in pixels whose centres lie at +0.5.
"""

from __future__ import annotations

import cv2
import numpy as np

from ...face.faces import Face
from ...imaging import images

EYES = ((33, 160, 158, 133, 153, 144), (362, 385, 387, 263, 373, 380))
"""Landmarks around the person's right and left eye, where FFHQ's 68 points have numbers 36 to 47."""
MOUTH = (61, 291)
BROWS = (105, 334)
FOREHEAD_RATIO = 0.3  # extension over the brows past the landmarks, which end below the hairline
FEATHER_PX = 16  # width of the face's soft edge, in pixels of the crop
MAX_DETAIL_RATIO = 4.0  # between a pixel and the crop's blur of it


def ffhq_alignment(face: Face, size: int, margin: float) -> np.ndarray:
    """Return the similarity [2, 3] by which FFHQ crops a face, its square scaled by `margin`."""
    points = face.landmarks[:, :2].astype(np.float64)
    right, left = (points[list(eye)].mean(0) for eye in EYES)
    eyes, down = (right + left) / 2, points[list(MOUTH)].mean(0) - (right + left) / 2
    across = (left - right) + [down[1], -down[0]]
    half = max(2.0 * np.linalg.norm(left - right), 1.8 * np.linalg.norm(down)) * margin
    c, s = across / np.linalg.norm(across) * size / (2 * half)
    x, y = eyes + 0.1 * down
    return np.array([[c, s, size / 2 - c * x - s * y], [-s, c, size / 2 + s * x - c * y]])


def cut_face(srgb: np.ndarray, to_crop: np.ndarray, size: int) -> np.ndarray:
    """Return the crop [size, size, 3]; black where the frame ends."""
    shrinks = 1 / np.hypot(*to_crop[:, 0])
    source = cv2.GaussianBlur(srgb, (0, 0), 0.5 * np.sqrt(shrinks**2 - 1)) if shrinks > 1.2 else srgb
    return np.clip(cv2.warpAffine(source, _from_centres(to_crop), (size, size), flags=cv2.INTER_CUBIC), 0, 1)


def face_mask(face: Face, to_crop: np.ndarray, size: int, growth: float = 1.0) -> np.ndarray:
    """Return float32 [size, size], 1 in the hull of a face's landmarks, extended over the forehead, in its crop.

    The hull is scaled by `growth` about its middle.
    """
    points = face.landmarks[:, :2] @ to_crop[:, :2].T + to_crop[:, 2]
    brow = points[list(BROWS), 1].mean()
    points[:, 1] += FOREHEAD_RATIO * np.minimum(points[:, 1] - brow, 0)  # upright in the crop
    middle = (points.min(0) + points.max(0)) / 2
    hull = cv2.convexHull((middle + growth * (points - middle)).astype(np.float32))
    mask = np.zeros((size, size), np.uint8)
    cv2.fillConvexPoly(mask, np.round(16 * (hull - 0.5)).astype(np.int32), 1, shift=4)
    return mask.astype(np.float32)


def put_face_back(
    frame: np.ndarray, before: np.ndarray, after: np.ndarray, mask: np.ndarray, to_crop: np.ndarray
) -> np.ndarray:
    """Paste an edited crop into its frame, feathered inside of the mask; float32 [H, W, 3], sRGB.

    before, after: sRGB [S, S, 3], the crop as it was cut and edited. The sharpness that the crop lost is given back, so
    that an unchanged crop gives the frame itself.
    """
    height, width = frame.shape[:2]
    inverse = cv2.invertAffineTransform(_from_centres(to_crop))
    inner = np.pad(mask[2:-2, 2:-2], 2).astype(np.uint8)  # 0 along the crop's border too
    inside = cv2.distanceTransform(inner, cv2.DIST_L2, 5)
    alpha, through, made = (
        cv2.warpAffine(picture.astype(np.float32), inverse, (width, height), flags=cv2.INTER_CUBIC)
        for picture in (np.clip(inside / FEATHER_PX, 0, 1), before, after)
    )
    through, made, linear = (
        np.maximum(images.srgb_to_linear(np.clip(picture, 0, 1)), 1e-4) for picture in (through, made, frame)
    )
    sharp = images.linear_to_srgb(made * np.clip(linear / through, 1 / MAX_DETAIL_RATIO, MAX_DETAIL_RATIO))
    return (frame + np.clip(alpha, 0, 1)[..., None] * (sharp - frame)).astype(np.float32)


def _from_centres(matrix: np.ndarray) -> np.ndarray:
    """Convert a map for OpenCV, which counts from pixel centres."""
    return np.column_stack([matrix[:, :2], matrix[:, 2] + matrix[:, :2] @ [0.5, 0.5] - 0.5])
