# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw lines of text in Blender's own font: its text objects become triangles, which are filled here.

Needs no window, scene or render.
"""

import bpy
import numpy as np

from ..data_blocks import read_field

FONT_LINE_SHARE = 0.52
"""Size of the letters as a share of a line's height."""
SUBPIXELS = 4
"""Subpixels per side."""


def draw(lines: list[list[str]], width: int, height: int) -> list[np.ndarray]:
    """Draw each line's words, centred in equal shares of the width.

    Returns float32 [height, width, 1] in [0, 1] per line, rows from the bottom.
    """
    strips = []
    for words in lines:
        fine = np.zeros((height * SUBPIXELS, width * SUBPIXELS), bool)
        for i, word in enumerate(words):
            shift = np.array([(i + 0.5) / len(words) * width, height / 2])
            for triangle in (_triangles(word) * FONT_LINE_SHARE * height + shift) * SUBPIXELS:
                _fill(fine, triangle)
        strips.append(fine.reshape(height, SUBPIXELS, width, SUBPIXELS).mean((1, 3), dtype=np.float32)[..., None])
    return strips


def _triangles(word: str) -> np.ndarray:
    """Return the triangles [N, 3, 2] of the letters at size 1 around the origin."""
    text = bpy.data.curves.new("WildCap Caption", 'FONT')
    text.body, text.align_x, text.align_y, text.resolution_u = word, 'CENTER', 'CENTER', 4
    obj = bpy.data.objects.new(text.name, text)
    mesh = bpy.data.meshes.new_from_object(obj)
    try:
        mesh.calc_loop_triangles()
        return read_field(mesh.vertices, "co", 3)[read_field(mesh.loop_triangles, "vertices", 3, np.int32), :2]
    finally:
        bpy.data.meshes.remove(mesh)
        bpy.data.curves.remove(text)  # and its object


def _fill(picture: np.ndarray, triangle: np.ndarray) -> None:
    """Set the pixels whose centre lies in a triangle [3, 2], in place."""
    low = np.maximum(np.floor(triangle.min(0)).astype(int), 0)
    high = np.minimum(np.ceil(triangle.max(0)).astype(int) + 1, picture.shape[::-1])
    if (high <= low).any():
        return
    x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
    ends = zip(triangle, np.roll(triangle, -1, 0), strict=True)
    sides = [(b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) for a, b in ends]
    picture[low[1] : high[1], low[0] : high[0]] |= (np.min(sides, 0) >= 0) | (np.max(sides, 0) <= 0)
