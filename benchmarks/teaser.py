# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The README's picture of a finished capture: frame, mask over the texture, albedo, specular, normal, renders.

    python -m benchmarks.teaser CAPTURE docs/pictures/teaser.jpg
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from core.contract.capture import Capture
from core.geometry.views import read_views
from core.imaging import images

SIDE = 360


def main() -> None:
    capture, target = Capture(Path(sys.argv[1])), Path(sys.argv[2])
    views = read_views(capture, selected_only=True)
    texture = images.read_srgb(capture.texture_png)
    mask = images.read_mask(capture.shadow_mask if capture.shadow_mask.exists() else capture.shadow_mask_auto)
    mask = images.resize(mask, texture.shape[1], texture.shape[0])[..., None]
    row = [images.read_srgb(views[len(views) // 2].path), texture * (1 - 0.6 * mask) + mask * np.float32([0.6, 0, 0])]
    row += [images.read_srgb(capture.maps / f"{name}.png") for name in ("diffuse_albedo", "specular_albedo", "normal")]
    row += [images.read_srgb(path) for path in sorted(capture.renders.glob("*.png"))]
    row = [_square(picture) for picture in row]
    half = (len(row) + 1) // 2
    row += [np.ones_like(row[0])] * (2 * half - len(row))
    images.write_srgb(target, np.vstack([np.hstack(row[:half]), np.hstack(row[half:])]), quality=88)


def _square(picture: np.ndarray) -> np.ndarray:
    """Cropped to its middle square and resampled to SIDE."""
    height, width = picture.shape[:2]
    side = min(height, width)
    top, left = (height - side) // 3, (width - side) // 2
    return images.resize(picture[top:top + side, left:left + side], SIDE, SIDE)


if __name__ == "__main__":
    main()
