# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Usual growth of the face's hair, by anatomy, from landmarks.

Brows begin upright at the nose and lie along their arch from a third of it on; a moustache leaves the middle of the
lip; a beard hangs.
"""

from __future__ import annotations

import numpy as np

# lower and upper landmarks of the person's brows, from the nose to the temple
LEFT_BROW = ((285, 336), (295, 296), (282, 334), (283, 293), (276, 300))
RIGHT_BROW = ((55, 107), (65, 66), (52, 105), (53, 63), (46, 70))
NOSE_BASE, MOUTH_CORNER = 2, 291


def usual(growth: str, position: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    """Return directions from root to tip [N, 3], not yet along the skin, by landmarks [468, 3]; all in mm."""
    return _brows(position, landmarks) if growth == "brows" else _beard(position, landmarks)


def _brows(position: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    directions = np.zeros_like(position)
    for brow, here in ((LEFT_BROW, position[:, 0] >= 0), (RIGHT_BROW, position[:, 0] < 0)):
        line = np.array([landmarks[list(pair)].mean(0) for pair in brow])
        axis = np.gradient(line, axis=0)
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        outer = np.abs(line[:, 0])  # grows from the nose to the temple
        x = np.abs(position[here, 0])
        along = np.stack([np.interp(x, outer, axis[:, k]) for k in range(3)], 1)
        done = np.clip((x - outer[0]) / (outer[-1] - outer[0]), 0, 1)
        directions[here] = along + np.clip(1 - 3 * done, 0, 1)[:, None] * [0, 0, 1.5]
    return directions


def _beard(position: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    x = position[:, :1] - landmarks[NOSE_BASE, 0]
    corner = landmarks[MOUTH_CORNER]
    above = np.clip((position[:, 2:] - corner[2]) / max(landmarks[NOSE_BASE, 2] - corner[2], 1.0), 0, 1)
    above = above * (np.abs(x) < 1.2 * abs(corner[0]))
    return above * np.tanh(x / 8) * [1.0, 0, 0] + [0, 0, -1.0]
