# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw the README's picture of a finished capture: frame, mask, albedo, and the head under three lights.

python -m research.benchmarks.pictures.teaser .demo/sample.wildcap docs/pictures/teaser.jpg
"""

from pathlib import Path

from core.capture.capture import Capture
from core.geometry.views import read_views
from core.imaging import images

from ..figures import command_line
from .sheet import in_rows, square, texture_and_mask

SIDE = 480
LIGHTS = "sun", "three_point", "window"


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("capture", type=Path, help="solved and rendered, as `make demo` leaves it")
    parser.add_argument("target", type=Path)
    options = parser.parse_args()
    capture = Capture(options.capture)
    views = read_views(capture, selected_only=True)
    maps = capture.maps_4k if capture.maps_4k.is_dir() else capture.maps
    frame, albedo = views[len(views) // 2].path, maps / "diffuse_albedo.png"
    relit = [images.read_srgb(capture.renders / f"{light}.png") for light in LIGHTS]
    pictures = [images.read_srgb(frame), texture_and_mask(capture)[1], images.read_srgb(albedo), *relit]
    tiles = [square(picture, SIDE, above=3) for picture in pictures]
    images.write_srgb(options.target, in_rows(tiles, len(LIGHTS)), quality=88)


if __name__ == "__main__":
    main()
