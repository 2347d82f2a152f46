# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What one view sees of the head's surface: its colours at every texel, and how well it saw them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from ...face.head import Unfolded
from ...geometry import raster
from ...geometry.views import View, lengths
from .held_picture import HeldPicture

MARGIN_PX = (1.5, 12.0)
"""Pixels from a silhouette at which a texel starts to count, and counts in full."""
JUMP_PX = 16
"""Jump of the depth that is a silhouette, in pixels: across the two that 3 x 3 span, a surface at 83 degrees."""
GRAZING_COSINE = 0.15
"""Cosine of the steepest viewing angle that counts."""
POINTS_AT_ONCE = 1 << 18
"""Points of the surface that are looked at at once: of a whole map the numbers on the way would take a gigabyte."""


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

    def resample(self, pixels: np.ndarray, warp: np.ndarray | None) -> None:
        """Reads the picture anew, at other pixels [S, S, 2]; one resampling from the original, never two. They are kept
        with the warp that led to them, where that is the last one."""
        if warp is not None:
            self.pixels, self.warp = pixels, warp
        self.log_colour = self.picture.log_colours(pixels)

    def enlarged(self, size: int, covered: np.ndarray) -> UnwrappedView:
        """The same on a map of `size`, `covered` [S, S] being the texels of this one: where each texel is seen, and how
        well, vary smoothly; the picture is read anew."""
        if size == len(self.weight):
            return self

        def larger(image: np.ndarray) -> np.ndarray:
            return cv2.resize(image, (size, size), interpolation=cv2.INTER_LINEAR)

        pixels = larger(raster.bleed(self.pixels, covered))
        warp = None if self.warp is None else larger(self.warp) * np.float32(size / len(self.weight))
        return replace(
            self,
            pixels=pixels,
            log_colour=self.picture.log_colours(pixels),
            quality=larger(self.quality),
            weight=larger(self.weight),
            warp=warp,
        )


def observe(
    view: View, picture: HeldPicture, surface: Unfolded, sharpness: float, reference_m: float | None = None
) -> UnwrappedView:
    """Projects every texel into a picture of a view.

    Parameters
    ----------
    view : the camera
    picture : of any size; no more of it is kept than shows the head
    surface : of the head, unfolded
    sharpness : in [0, 1], scales the view's weight
    reference_m : width in metres, on the head, of the pixels of the view that others are weighed beside; None: this
        view's own
    """
    count, scale = len(surface.points), [picture.shape[1] / view.width, picture.shape[0] / view.height]
    pixels, quality, distance = np.empty((count, 2), np.float32), np.empty(count), np.empty(count)
    seen, silhouette = np.empty(count, bool), raster.silhouette_distance(surface.caster, view, 0.5, JUMP_PX)
    for first in range(0, count, POINTS_AT_ONCE):
        chunk = slice(first, first + POINTS_AT_ONCE)
        xy, quality[chunk], distance[chunk], seen[chunk] = _look(view, surface, chunk, silhouette)
        pixels[chunk] = np.nan_to_num(xy, nan=-1) * scale
    picture, pixels = picture.around(pixels), surface.spread(pixels)
    pixel_m = distance / view.camera.mean_focal_length()
    if reference_m is None:
        reference_m = float(np.median(pixel_m[seen])) if seen.any() else 1.0
    weight = quality**2 * sharpness * (reference_m / pixel_m) ** 2
    return UnwrappedView(
        view, picture, pixels, picture.log_colours(pixels), surface.spread(quality), surface.spread(weight)
    )


def _look(
    view: View, surface: Unfolded, rows: slice, silhouette: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Of a part of the surface's points: pixels [N, 2] (nan behind the camera), quality [N], distance [N], and whether
    they are seen [N]."""
    points, normals = surface.points[rows], surface.normals[rows]
    xy, depth = view.project(points)
    inside = (depth > 0) & (xy[:, 0] > 1) & (xy[:, 1] > 1) & (xy[:, 0] < view.width - 1) & (xy[:, 1] < view.height - 1)
    towards = view.centre - points
    distance = lengths(towards)
    cosine = (towards * normals).sum(1) / distance
    seen = inside & (cosine > GRAZING_COSINE)
    seen[seen] = raster.visible_from(surface.caster, points[seen], normals[seen], view.centre)
    margin = np.zeros(len(xy))
    margin[seen] = raster.sample(silhouette, xy[seen])
    near, far = MARGIN_PX
    ramp = np.clip((margin - near) / (far - near), 0, 1)
    return xy, np.where(seen, np.clip((cosine - GRAZING_COSINE) / (1 - GRAZING_COSINE), 0, 1) * ramp, 0), distance, seen
