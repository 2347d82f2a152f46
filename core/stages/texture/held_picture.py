# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures in memory: the part that shows the head, in the file's own integers, made linear when they are read.

As floats, 64 views of 4K would take 6 GB.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from ...imaging import images

DARKEST_LINEAR = 2e-3  # below this a logarithm sees noise
MARGIN_PX = 8  # held around the head: a cubic reads 2 beyond its place, the perceptual step 4


@dataclass(frozen=True)
class HeldPicture:
    """Part of a linear picture of `shape` [H, W].

    stored [h, w, 3], whose first column and row are `corner`, holds integers that encode sRGB, or linear floats if the
    file's were floats. Its linear values are multiplied by exp(log_gain) [3].
    """

    stored: np.ndarray
    corner: tuple[int, int]
    shape: tuple[int, int]
    log_gain: np.ndarray | float = 0.0

    def around(self, pixels: np.ndarray) -> HeldPicture:
        """Return the part around pixels [..., 2] (x, y; pixel centres at + 0.5), with a margin."""
        height, width = self.shape
        points = pixels.reshape(-1, 2)
        left, top = np.clip(np.floor(points.min(0)) - MARGIN_PX, 0, [width - 1, height - 1]).astype(int)
        right, bottom = np.clip(np.ceil(points.max(0)) + MARGIN_PX, [left + 1, top + 1], [width, height]).astype(int)
        return replace(
            self, stored=self._part(slice(top, bottom), slice(left, right)).copy(), corner=(int(left), int(top))
        )

    def brightened(self, log_gain: np.ndarray) -> HeldPicture:
        """Return the same under another exposure [3]."""
        return replace(self, log_gain=self.log_gain + log_gain)

    def linear(self, rows: slice, columns: slice) -> np.ndarray:
        """Return float32 [h, w, 3] for rows and columns of the whole picture, which must be held."""
        return self._decoded(self._part(rows, columns))

    def log_colours(self, pixels: np.ndarray) -> np.ndarray:
        """Return the natural log of linear colours [S, S, 3] at pixels [S, S, 2]; the border of the part repeats.

        Interpolation is bicubic, for bilinear would soften pores.
        """
        x, y = (np.ascontiguousarray(pixels[..., i] - 0.5 - self.corner[i], np.float32) for i in range(2))
        colours = cv2.remap(self._decoded(self.stored), x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        return np.log(np.maximum(colours, DARKEST_LINEAR))

    def _part(self, rows: slice, columns: slice) -> np.ndarray:
        left, top = self.corner
        return self.stored[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]

    def _decoded(self, stored: np.ndarray) -> np.ndarray:
        gain = np.exp(self.log_gain)
        if stored.dtype == np.float32:
            return (stored * gain).astype(np.float32)
        most = np.iinfo(stored.dtype).max
        levels = images.srgb_to_linear(_as_read(np.arange(most + 1), most))
        table = (levels[:, None] * np.broadcast_to(gain, 3)).astype(np.float32)  # [levels, 3]
        return np.stack([table[stored[..., k], k] for k in range(3)], -1)


def hold(linear: np.ndarray) -> HeldPicture:
    """Hold a linear picture [H, W, 3] that is in no file."""
    return HeldPicture(np.asarray(linear, np.float32), (0, 0), linear.shape[:2])


def read_held(path: Path) -> HeldPicture:
    """Read a whole picture file; its linear values are those of `images.read_linear`."""
    bits = images.bits(path)
    if images.is_linear(path) or bits > 16:
        return hold(images.read_linear(path))
    srgb, kind = images.read_srgb(path), np.uint8 if bits == 8 else np.uint16
    return HeldPicture(np.rint(srgb * np.iinfo(kind).max).astype(kind), (0, 0), srgb.shape[:2])


def _as_read(integers: np.ndarray, most: int) -> np.ndarray:
    """Scale integers to [0, 1] as OpenImageIO does: by a product, which is not always the quotient."""
    return integers.astype(np.float32) * (np.float32(1) / np.float32(most))
