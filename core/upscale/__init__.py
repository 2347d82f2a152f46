# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stage upscale: maps/ becomes maps_4k/, the same names at settings.upscale.size.

By resampling: it adds no detail, and the report says so. Light and albedo are resampled in linear light.
"""

from __future__ import annotations

import numpy as np

from .. import images
from ..capture import Capture, replacing_folder
from ..messages import Reporter
from ..settings import Settings

METHOD = "Lanczos resampling, no network yet"
STRIP = 256
"""Rows that are worked on at once: a whole 4096 map in float32 is 200 MB, and each operation on it would make another."""
CROP = 0.12
"""Side of the report's picture, as a share of the map."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Writes capture.maps_4k, whole or not at all."""
    size = settings.upscale.size
    with replacing_folder(capture.maps_4k) as folder:
        report.progress(0, 5, "diffuse albedo")
        diffuse = _enlarged(images.read_linear(capture.maps / "diffuse_albedo.exr"), size)
        images.write_linear(folder / "diffuse_albedo.exr", diffuse)
        report.progress(1, 5, "diffuse albedo")
        _by_strips(diffuse, images.linear_to_srgb)
        images.write_srgb(folder / "diffuse_albedo.png", diffuse, bits=16)
        _picture(capture, diffuse)
        del diffuse
        report.progress(2, 5, "normals")
        normal = _enlarged(images.read_data(capture.maps / "normal.png")[..., :3], size)
        _by_strips(normal, _unit)
        images.write_data(folder / "normal.png", normal, bits=16)
        del normal
        report.progress(3, 5, "specular albedo and confidence")
        images.write_data(folder / "specular_albedo.png", _enlarged(images.read_mask(capture.maps / "specular_albedo.png"), size), bits=16)
        images.write_data(folder / "confidence.png", _enlarged(images.read_mask(capture.maps / "confidence.png"), size))
        report.progress(4, 5, "shading")
        images.write_linear(folder / "shading.exr", _enlarged(images.read_linear(capture.maps / "shading.exr"), size))
        report.progress(5, 5)
    height, width = images.read_mask(capture.maps / "confidence.png").shape
    report.figure("method", METHOD)
    report.figure("size_from_px", max(height, width))
    report.figure("size_px", size)


def _enlarged(image: np.ndarray, size: int) -> np.ndarray:
    """[H, W(, C)] -> [size, size(, C)], within the range of `image`: Lanczos overshoots at hard edges, and no albedo is negative."""
    if image.shape[:2] == (size, size):
        return image
    return np.clip(images.resize(image, size, size), image.min(), image.max())


def _by_strips(image: np.ndarray, operation) -> None:
    """Applies a texel-wise operation in place."""
    for row in range(0, len(image), STRIP):
        image[row:row + STRIP] = operation(image[row:row + STRIP])


def _unit(packed: np.ndarray) -> np.ndarray:
    """Normals packed into [0, 1], [H, W, 3], made unit again."""
    vectors = packed * 2 - 1
    return vectors / np.maximum(np.linalg.norm(vectors, axis=2, keepdims=True), 1e-6) * 0.5 + 0.5


def _picture(capture: Capture, srgb: np.ndarray) -> None:
    """A crop from the middle of the map, texel by texel."""
    side = int(CROP * len(srgb))
    start = (len(srgb) - side) // 2
    images.write_srgb(capture.picture("upscale", "crop"), srgb[start:start + side, start:start + side])
