# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw the README's picture of a finished capture: frame, mask, albedo, and the head under three lights.

python -m research.benchmarks.pictures.teaser .demo/sample.wildcap docs/pictures/teaser.jpg
"""

from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.geometry.views import read_views
from core.imaging import images

from ..figures import command_line
from .sheet import in_rows, square

SIDE = 480
LIGHTS = "sun", "three_point", "window"


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("capture", type=Path, help="solved and rendered, as `make demo` leaves it")
    parser.add_argument("target", type=Path)
    arguments = parser.parse_args()
    capture = Capture(arguments.capture)
    views = read_views(capture, selected_only=True)
    texture = images.read_srgb(capture.texture_png)
    mask = images.read_mask(capture.shadow_mask if capture.shadow_mask.exists() else capture.shadow_mask_auto)
    mask = images.resize(mask, texture.shape[1], texture.shape[0])[..., None]
    albedo = capture.maps_4k if capture.maps_4k.is_dir() else capture.maps
    filmed = [
        images.read_srgb(views[len(views) // 2].path),
        texture * (1 - 0.6 * mask) + mask * np.float32([0.6, 0, 0]),
        images.read_srgb(albedo / "diffuse_albedo.png"),
    ]
    relit = [images.read_srgb(capture.renders / f"{light}.png") for light in LIGHTS]
    images.write_srgb(
        arguments.target,
        in_rows([square(picture, SIDE, above=3) for picture in (*filmed, *relit)], len(LIGHTS)),
        quality=88,
    )


if __name__ == "__main__":
    main()
