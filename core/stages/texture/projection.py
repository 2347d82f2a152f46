# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One view of the head's surface: its colours at every texel, and how well it sees them."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ...face.head import Unfolded
from ...geometry import raster
from ...geometry.views import View, lengths
from ...geometry.visibility import points_in_view, silhouette_distance
from .held_picture import HeldPicture

MARGIN_PX = (1.5, 12.0)  # pixels from a silhouette at which a texel starts to count, and counts in full
GRAZING_COSINE = 0.15  # cosine of the steepest viewing angle that counts
POINTS_AT_ONCE = 1 << 18  # bounds the memory: intermediate values of a whole map would take a gigabyte


@dataclass
class UnwrappedView:
    """One view in UV space, float32 [S, S, ...]; zero weight where it sees nothing."""

    view: View
    picture: HeldPicture
    pixels: np.ndarray  # [S, S, 2] where in the picture each texel is seen
    log_colour: np.ndarray  # [S, S, 3] natural logarithm of linear colour
    quality: np.ndarray  # [S, S] in [0, 1]: angle and silhouette only; makes the confidence map
    weight: np.ndarray  # [S, S] quality with distance and sharpness: who wins where
    # [S, S, 2] texels by which the alignment moved it: `pixels` here is what was there, one warp further
    warp: np.ndarray | None = None

    @property
    def name(self) -> str:
        return self.view.name

    def fade(self, kept: np.ndarray) -> None:
        """Keep a share [S, S] in [0, 1] of quality and weight."""
        self.quality, self.weight = self.quality * kept, self.weight * kept

    def resample(self, pixels: np.ndarray, warp: np.ndarray | None) -> None:
        """Read the picture anew at other pixels [S, S, 2]: one resampling from the original, never two.

        With the last warp that led to them, the pixels are kept.
        """
        if warp is not None:
            self.pixels, self.warp = pixels, warp
        self.log_colour = self.picture.log_colours(pixels)

    def enlarged(self, size: int, covered: np.ndarray) -> UnwrappedView:
        """Return the view on a map of `size`; covered: bool [S, S], texels of the head on this one.

        Where each texel is seen, and how well, vary smoothly; the picture is read anew.
        """
        if size == len(self.weight):
            return self

        def larger(image: np.ndarray) -> np.ndarray:
            return cv2.resize(image, (size, size), interpolation=cv2.INTER_LINEAR)

        pixels = larger(raster.bleed(self.pixels, covered))
        warp = None if self.warp is None else larger(self.warp) * np.float32(size / len(self.weight))
        return UnwrappedView(
            self.view,
            self.picture,
            pixels,
            self.picture.log_colours(pixels),
            larger(self.quality),
            larger(self.weight),
            warp,
        )


def observe(
    view: View, picture: HeldPicture, surface: Unfolded, sharpness: float, reference_m: float | None = None
) -> UnwrappedView:
    """Project every texel into a picture, of any size, of a view; only the part that shows the head is kept.

    `sharpness` in [0, 1] scales the view's weight, and so does the size of its pixels on the head against
    `reference_m`, in metres (None: the view's own).
    """
    count, scale = len(surface.points), [picture.shape[1] / view.width, picture.shape[0] / view.height]
    pixels, quality, visible = np.empty((count, 2), np.float32), np.zeros(count), np.zeros(count, bool)
    silhouette, (near, far) = silhouette_distance(surface.caster, view, scale=0.5, slope=16), MARGIN_PX
    for first in range(0, count, POINTS_AT_ONCE):
        chunk = slice(first, first + POINTS_AT_ONCE)
        index, cosine, xy = points_in_view(
            surface.caster, view, surface.points[chunk], surface.normals[chunk], GRAZING_COSINE
        )
        away = raster.sample(silhouette, xy[index]).astype(np.float64)
        margin = np.clip((away - near) / (far - near), 0, 1)
        quality[first + index] = (cosine[index] - GRAZING_COSINE) / (1 - GRAZING_COSINE) * margin
        visible[first + index] = True
        pixels[chunk] = np.nan_to_num(xy, nan=-1) * scale
    picture, pixels = picture.around(pixels), surface.spread(pixels)
    pixel_m = lengths(view.centre - surface.points) / view.camera.mean_focal_length()
    if reference_m is None:
        reference_m = float(np.median(pixel_m[visible])) if visible.any() else 1.0
    weight = quality**2 * sharpness * (reference_m / pixel_m) ** 2
    return UnwrappedView(
        view, picture, pixels, picture.log_colours(pixels), surface.spread(quality), surface.spread(weight)
    )
