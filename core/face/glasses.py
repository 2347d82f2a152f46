# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Glasses on a face: strength of thin lines around both eyes by direction and place, and one plane through it.

Rims, bridge and temples are thin lines where a bare face has none, bright or dark; hard shadows are steps, creases are
faint. `python -m research.training glasses` finds the plane, on synthetic people only.
"""

from functools import cache
from pathlib import Path

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter

from ..capture import shipped_files
from . import faces
from .parts import from_centres

DATA_FILES = ("weights/glasses.npz",)
WEIGHTS = Path(__file__).resolve().parents[1] / DATA_FILES[0]
WIDTH_PX, HEIGHT_PX, CELL_PX = 128, 64, 8  # size of the band, and of a cell in which lines are counted
THIN_PX, DIRECTIONS = 1.1, 6  # scale of the lines, 1.2 mm to a pixel, and the number of directions
GAMMA, DARK, FLAT = 2.2, 0.02, 0.15
"""Logarithm of light: exponent of an sRGB value, offset so that black is no line, and offset of the deviation so that
an even picture is none either."""
SPAN_EYES = 1.75  # width of the band in distances between the outer corners of the eyes: nearly from ear to ear
BELOW_WIDTH_SHARE = 0.08
"""Depth of the band's middle below the eyes, as a share of its width: the lower rims lie on the cheeks."""
OUTER = (33, 263)
MOST_YAW_DEG = 50.0  # maximum turn of the head: beyond, the nose hides a rim


def band(srgb: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    """Cut the upright band around the eyes, float32 [HEIGHT_PX, WIDTH_PX], by a Face's landmarks [468, 3]."""
    right, left = landmarks[list(OUTER)].astype(np.float64)
    across = left[:2] - right[:2]
    across /= max(np.linalg.norm(across), 1e-6)
    scale = WIDTH_PX / (
        SPAN_EYES * max(np.linalg.norm(left - right), 1e-6)
    )  # in space, so that a turned head is no narrower
    turn = scale * np.array([across, [-across[1], across[0]]])
    middle = turn @ ((left + right) / 2)[:2]
    move = np.concatenate(
        [turn, (np.array([WIDTH_PX / 2, HEIGHT_PX / 2 - BELOW_WIDTH_SHARE * WIDTH_PX]) - middle)[:, None]], 1
    )
    grey = np.ascontiguousarray(srgb @ np.float32([0.299, 0.587, 0.114]), np.float32)
    if scale < 0.8:  # the warp would alias
        grey = cv2.GaussianBlur(grey, (0, 0), 0.4 * float(np.sqrt(1 / scale**2 - 1)))
    return cv2.warpAffine(
        grey, from_centres(move), (WIDTH_PX, HEIGHT_PX), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )


def describe(strip: np.ndarray) -> np.ndarray:
    """Return the strength of thin bright and dark lines by direction and cell of a band, a float32 vector."""
    shade = np.log(np.clip(strip, 0, 1).astype(np.float64) ** GAMMA + DARK)
    shade = (shade - shade.mean()) / (shade.std() + FLAT)
    down, across, askew = (gaussian_filter(shade, THIN_PX, order=order) for order in ((2, 0), (0, 2), (1, 1)))
    middle, apart = (across + down) / 2, np.hypot((across - down) / 2, askew)  # of the two curvatures
    turn = (np.arctan2(2 * askew, across - down) / 2 % np.pi) * DIRECTIONS / np.pi
    layers = []
    for sign, quarter in ((1, 0), (-1, DIRECTIONS / 2)):
        # curved in one direction only, unlike steps and spots
        line = np.maximum(sign * middle + apart - np.abs(sign * middle - apart), 0)
        for k in range(DIRECTIONS):
            off = np.abs((turn + quarter - k + DIRECTIONS / 2) % DIRECTIONS - DIRECTIONS / 2)
            layers.append(line * np.clip(1 - off, 0, 1))
    cells = np.stack(layers).reshape(len(layers), HEIGHT_PX // CELL_PX, CELL_PX, WIDTH_PX // CELL_PX, CELL_PX)
    return np.sqrt(cells.mean((2, 4))).astype(np.float32).ravel()


def sureness(srgb: np.ndarray, face: faces.Face) -> float:
    """Return the log odds that the face in an sRGB picture [H, W, 3] wears glasses; nan if turned too far."""
    if abs(face.yaw_deg) > MOST_YAW_DEG:
        return float("nan")
    plane, offset = _plane()
    return float(describe(band(srgb, face.landmarks)) @ plane + offset)


@cache
def _plane() -> tuple[np.ndarray, float]:
    shipped_files.require_whole(WEIGHTS)
    with np.load(WEIGHTS, allow_pickle=False) as stored:
        return stored["plane"], float(stored["offset"])
