# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture as a view is held by: the part of it that shows the head, in the file's own integers, which are brought to
linear light when they are read. As floats, 64 views of 4K would take 6 GB."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from ...imaging import images

DARKEST_LINEAR = 2e-3
"""Linear values below this are noise to a logarithm."""
MARGIN_PX = 8
"""Pixels that are held around the head: a cubic reads 2 beyond where it looks, the perceptual step 4."""


@dataclass(frozen=True)
class HeldPicture:
    """A linear picture of `shape` [H, W], as far as it is held.

    stored [h, w, 3] is its part whose first column and row are `corner`: integers that encode sRGB, or linear floats
    where the file's were floats. Its linear values are multiplied by exp(log_gain) [3].
    """

    stored: np.ndarray
    corner: tuple[int, int]
    shape: tuple[int, int]
    log_gain: np.ndarray | None = None

    def around(self, pixels: np.ndarray) -> HeldPicture:
        """No more of it than a margin around pixels [..., 2] (x, y; pixel centres at + 0.5)."""
        height, width = self.shape
        points = pixels.reshape(-1, 2)
        left, top = np.clip(np.floor(points.min(0)) - MARGIN_PX, 0, [width - 1, height - 1]).astype(int)
        right, bottom = np.clip(np.ceil(points.max(0)) + MARGIN_PX, [left + 1, top + 1], [width, height]).astype(int)
        return replace(
            self, stored=self._part(slice(top, bottom), slice(left, right)).copy(), corner=(int(left), int(top))
        )

    def brightened(self, log_gain: np.ndarray) -> HeldPicture:
        """The same under another exposure [3]."""
        return replace(self, log_gain=log_gain if self.log_gain is None else self.log_gain + log_gain)

    def linear(self, rows: slice, columns: slice) -> np.ndarray:
        """float32 [h, w, 3] of rows and columns of the whole picture, which are held."""
        return self._decoded(self._part(rows, columns))

    def log_colours(self, pixels: np.ndarray) -> np.ndarray:
        """Bicubic natural log of linear colours [S, S, 3] at pixels [S, S, 2]; bilinear would soften pores. Beyond what
        is held its border repeats."""
        x, y = (np.ascontiguousarray(pixels[..., i] - 0.5 - self.corner[i], np.float32) for i in range(2))
        colours = cv2.remap(self._decoded(self.stored), x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        return np.log(np.maximum(colours, DARKEST_LINEAR))

    def _part(self, rows: slice, columns: slice) -> np.ndarray:
        left, top = self.corner
        return self.stored[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]

    def _decoded(self, stored: np.ndarray) -> np.ndarray:
        gain = 1.0 if self.log_gain is None else np.exp(self.log_gain)
        if stored.dtype == np.float32:
            return (stored * gain).astype(np.float32)
        most = np.iinfo(stored.dtype).max
        levels = images.srgb_to_linear(_as_read(np.arange(most + 1), most))
        table = (levels[:, None] * np.broadcast_to(gain, 3)).astype(np.float32)  # [levels, 3]
        return np.stack([table[stored[..., k], k] for k in range(3)], -1)


def hold(linear: np.ndarray) -> HeldPicture:
    """A linear picture [H, W, 3] that no file holds."""
    return HeldPicture(np.asarray(linear, np.float32), (0, 0), linear.shape[:2])


def read_held(path: Path) -> HeldPicture:
    """A picture file, whole; its linear values are those of `images.read_linear`."""
    bits = images.bits(path)
    if images.is_linear(path) or bits > 16:
        return hold(images.read_linear(path))
    srgb, kind = images.read_srgb(path), np.uint8 if bits == 8 else np.uint16
    return HeldPicture(np.rint(srgb * np.iinfo(kind).max).astype(kind), (0, 0), srgb.shape[:2])


def _as_read(integers: np.ndarray, most: int) -> np.ndarray:
    """Integers in [0, 1] as OpenImageIO scales them: by a product, which is not always the quotient."""
    return integers.astype(np.float32) * (np.float32(1) / np.float32(most))
