# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pinhole cameras around a head, as views."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pycolmap

from core.geometry.views import View


def pinhole_view(
    size: tuple[int, int], focal: float, principal: np.ndarray, rotation: np.ndarray, translation: np.ndarray
) -> View:
    """Return a view without a file; size (width, height), focal length and principal point [2] in pixels."""
    camera = pycolmap.Camera(
        camera_id=1, model="PINHOLE", width=size[0], height=size[1], params=[focal, focal, *principal]
    )
    return View("", Path(), camera, rotation, translation, True)


def hold_camera(
    landmarks: np.ndarray, yaw: float, pitch: float, roll: float, distance: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Hold a camera before landmarks [468, 3] in metres, towards their mean; angles in radians.

    Returns rotation [3, 3] and translation [3] (world to camera), and the box [2, 2] (low, high) of the landmarks on
    the plane at depth 1.
    """
    back = np.array([np.sin(yaw) * np.cos(pitch), -np.cos(yaw) * np.cos(pitch), np.sin(pitch)])
    right = np.cross([0, 0, 1.0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    right, up = np.cos(roll) * right + np.sin(roll) * up, np.cos(roll) * up - np.sin(roll) * right
    rotation, middle = np.stack([right, -up, -back]), landmarks.mean(0)
    local = (landmarks - middle) @ rotation.T + [0, 0, distance]
    plane = local[:, :2] / local[:, 2:]
    translation = np.array([0, 0, distance]) - rotation @ middle
    return rotation, translation, np.stack([plane.min(0), plane.max(0)])
