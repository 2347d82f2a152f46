# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cells of the built-in head for the split of skin and light (split.py), with how far skins differ there."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import cv2
import numpy as np

from ...face import template
from ...geometry import raster
from ...solver.extensions.split import HeadCells

DATA_FILES = ("weights/traits.json",)
TRAITS_FILE = Path(__file__).parents[2] / DATA_FILES[0]


@cache
def make_head_cells(count: int) -> HeadCells:
    """Return the built-in map's count x count cells."""
    places, covered = place_cells(count)
    variation = np.ascontiguousarray(read_variation(), np.float32)
    varied = cv2.resize(variation, (count, count), interpolation=cv2.INTER_AREA)[covered].astype(np.float64)
    number = np.zeros(covered.shape, np.int64)
    number[covered] = np.arange(len(places))
    return HeadCells(covered, places, varied, raster.bleed(number, covered))


@cache
def read_variation() -> np.ndarray:
    """Read the deviation of skins from their mean at places of the built-in map [C, C], over the face's own mean."""
    return np.array(json.loads(TRAITS_FILE.read_text(encoding="utf-8"))["deviation"])


@cache
def place_cells(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the places [N, 3] of count x count cells on the built-in head, and which of them lie on it."""
    mesh = template.load()
    face, bary = raster.rasterize_uv(mesh, count)
    return raster.interpolate(mesh.vertices, mesh.faces, face, bary)[face >= 0], face >= 0
