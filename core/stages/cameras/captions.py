# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Captions and logos that lie over a film: edges that keep their place while everything else moves.

Their features match perfectly and say that the camera stood still. An edge keeps its place if the mean of its gradients
over frames is as long as they are (Dekel et al., On the Effectiveness of Visible Watermarks, 2017). Lettering has edges
in all directions; a shelf along which the camera moves has one.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from ...capture.frame_records import FrameRecord
from ...imaging import images
from .coverage import spread_evenly

LONG_SIDE_PX = 480
"""Size at which frames are compared."""
STRETCHES, FRAMES_EACH = 6, 12
"""Parts of a film that are looked at, as captions come and go, and frames of each."""
LEAST_EDGE = 0.03
"""Gradient of an edge, in sRGB per pixel: that of a logo with an opacity of a quarter."""
LEAST_KEPT = 0.96
"""Length of the mean gradient over the mean length, from which an edge keeps its place: noise and compression take
little of it, and the edges of a moving picture keep a third."""
LEAST_CORNER = 0.1
"""Ratio of the structure tensor's eigenvalues around lettering."""
AROUND_PX = 9
"""Side of that neighbourhood, and reach of a feature that sees the lettering."""
LEAST_PX = 40
"""Pixels of kept edges within a caption; fewer are chance."""
MOST_SHARE = 0.25
"""Share of the picture that captions may cover."""
REST_SHARE, REST_KEPT = 0.9, 0.9
"""Share of all other edges, and how much of their gradients they may keep: where more stays, the camera stood still."""


def find_captions(records: Sequence[FrameRecord], folder: Path) -> dict[str, np.ndarray]:
    """Return a mask [h, w] of bool, reduced in size, for each frame under a caption or logo."""
    if len({record.size for record in records}) != 1 or len(records) < FRAMES_EACH:
        return {}
    count = max(1, min(STRETCHES, len(records) // FRAMES_EACH))
    bounds = np.linspace(0, len(records), count + 1).round().astype(int)
    stretches = [[record.name for record in records[low:high]] for low, high in zip(bounds, bounds[1:], strict=False)]
    lumas = [[_read(folder / name) for name in spread_evenly(names, FRAMES_EACH)] for names in stretches]
    throughout = _kept(spread_evenly([luma for part in lumas for luma in part], FRAMES_EACH))
    masks = {}
    for names, part in zip(stretches, lumas, strict=True):
        mask = throughout | _kept(part)
        if mask.any():
            masks |= dict.fromkeys(names, mask)
    return masks


def write_masks(masks: dict[str, np.ndarray], records: Sequence[FrameRecord], out: Path) -> None:
    """Write NAME.png for each frame into `out`: black on its captions, white elsewhere."""
    for record in records:
        width, height = record.size
        mask = masks.get(record.name)
        seen = np.ones((height, width), np.float32)
        if mask is not None:
            seen -= cv2.resize(mask.astype(np.float32), (width, height), interpolation=cv2.INTER_NEAREST)
        images.write_data(out / f"{record.name}.png", seen)


def _read(path: Path) -> np.ndarray:
    """Read a frame's luma [h, w], reduced to LONG_SIDE_PX."""
    luma = images.luma(images.read_srgb(path))
    scale = min(1.0, LONG_SIDE_PX / max(luma.shape))
    return images.resize(luma, round(luma.shape[1] * scale), round(luma.shape[0] * scale))


def _kept(lumas: list[np.ndarray]) -> np.ndarray:
    """Return a mask [h, w] of what lies over all of these pictures [h, w]; empty where the rest stays as well."""
    x, y = (
        np.array([cv2.Sobel(luma, cv2.CV_32F, *order, scale=1 / 8) for luma in lumas]) for order in ((1, 0), (0, 1))
    )
    length, mean_x, mean_y = np.hypot(x, y).mean(0), x.mean(0), y.mean(0)
    edges, share = length > LEAST_EDGE, np.hypot(mean_x, mean_y) / np.maximum(length, 1e-6)
    kept = edges & (share > LEAST_KEPT)
    xx, yy, xy = (
        cv2.boxFilter(np.where(kept, product, 0), -1, (AROUND_PX, AROUND_PX))
        for product in (mean_x**2, mean_y**2, mean_x * mean_y)
    )
    middle, half = (xx + yy) / 2, np.sqrt(((xx - yy) / 2) ** 2 + xy**2)
    corners = kept & (middle - half > LEAST_CORNER * (middle + half))
    around = np.ones((AROUND_PX, AROUND_PX), np.uint8)
    _, parts, stats, _ = cv2.connectedComponentsWithStats(cv2.dilate(corners.astype(np.uint8), around), connectivity=8)
    inside = np.bincount(parts.ravel(), corners.ravel(), len(stats))
    large = inside >= LEAST_PX
    large[0] = False
    mask = cv2.dilate(large[parts].astype(np.uint8), around).astype(bool)
    rest = share[edges & ~mask]
    moves = len(rest) > 0 and np.quantile(rest, REST_SHARE) < REST_KEPT
    return mask if moves and mask.mean() < MOST_SHARE else np.zeros_like(mask)
