# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw one subject's picture of the gallery, two lines of seven.

    python -m research.benchmarks.pictures.gallery FOLDER/NAME.wildcap docs/pictures/gallery_NAME.jpg [--truth
        FOLDER/NAME/maps]

captured frame, delit frame, texture, shadow mask over it, diffuse albedo, true albedo (of --truth; black without it),
specular albedo; normals, shading, a close-up of the albedo beside the nose, the head under four lights of the add-on:
three lamps, a window, the sun, a city. Relit pictures are Cycles's linear light under the sRGB curve, clipped:
Blender's view transform Standard, no look, exposure as the presets have it. Renders that are newer than the maps are
taken as they are.
"""

from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.face import template
from core.geometry import meshes, raster
from core.geometry.views import View, read_views
from core.imaging import images

from ..figures import command_line, run_python
from .sheet import in_rows, texture_and_mask, write_small

LIGHTS = ("three_point", "window", "sun", "city.exr")
TILE, RESOLUTION, SAMPLES = 224, 320, 24  # pixels, pixels, rays per pixel
# MediaPipe's landmark beside the nose, on the person's right; side of the close-up as a share of the map
CHEEK, CLOSE_UP = 203, 0.11


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("capture", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--truth", type=Path)
    options = parser.parse_args()
    capture = Capture(options.capture.resolve())
    write_small(options.out, sheet(captured(capture) + solved(capture, options.truth) + relit(capture)))


def captured(capture: Capture) -> list[np.ndarray]:
    """Return frame and delit frame about the face, texture, and mask over the texture: sRGB, square."""
    head = meshes.read_obj(capture.head)
    delit = {
        view.name: capture.delit / f"{Path(view.name).stem}.png" for view in read_views(capture, selected_only=True)
    }
    views = [view for view in read_views(capture, selected_only=True) if delit[view.name].is_file()]
    view = max(views, key=lambda view: view.axis[1])  # from the front
    box = face_square(view, head)
    # a delighter knows nothing of what is behind the head
    cover = (raster.render_view(raster.RayCaster(head), view)[0] >= 0)[..., None]
    return [view.read()[box], (images.read_srgb(delit[view.name]) * cover)[box], *texture_and_mask(capture)]


def solved(capture: Capture, truth: Path | None) -> list[np.ndarray]:
    """Return albedo, true albedo, specular, normal, shading and a close-up of the albedo: sRGB, square."""
    maps = capture.maps_4k if (capture.maps_4k / "shading.exr").is_file() else capture.maps
    albedo = images.read_srgb(maps / "diffuse_albedo.png")
    true = images.read_srgb(truth / "diffuse_albedo.png") if truth else np.zeros((8, 8, 3), np.float32)
    specular, normal = (images.read_data(capture.maps / f"{name}.png") for name in ("specular_albedo", "normal"))
    shading = images.read_linear(capture.maps / "shading.exr")
    shading = images.linear_to_srgb(shading * (0.6 / max(float(np.percentile(shading, 95)), 1e-6)))
    side = round(CLOSE_UP * len(albedo))
    column, row = np.round(landmark_uv(CHEEK) * len(albedo) - side / 2).astype(int)
    return [
        albedo,
        true,
        np.repeat(specular[..., :1], 3, 2),
        normal[..., :3],
        shading,
        albedo[row : row + side, column : column + side],
    ]


def relit(capture: Capture) -> list[np.ndarray]:
    """Return the head under LIGHTS, rendered where that is not done: sRGB, square."""
    paths = [capture.renders / f"{Path(light).stem}.exr" for light in LIGHTS]
    made = max(
        path.stat().st_mtime
        for folder in (capture.maps, capture.maps_4k)
        if folder.is_dir()
        for path in folder.glob("*.png")
    )
    stale = [
        light for light, path in zip(LIGHTS, paths, strict=True) if not path.is_file() or path.stat().st_mtime < made
    ]
    size = ("--resolution", RESOLUTION, "--samples", SAMPLES)
    if stale and run_python("research.benchmarks.pictures.render_capture", capture.root, *stale, *size, quiet=True):
        raise SystemExit("The renders failed.")
    return [images.linear_to_srgb(images.read_linear(path)) for path in paths]


def face_square(view: View, head: meshes.Mesh) -> tuple[slice, slice]:
    """Return rows and columns of the square about the face in a view, within the picture."""
    pixels, _ = view.project(template.landmark_points(head))
    middle, side = (pixels.min(0) + pixels.max(0)) / 2, 1.35 * (pixels.max(0) - pixels.min(0)).max()
    side = int(min(side, view.width, view.height))
    left, top = (int(np.clip(middle[k] - side / 2, 0, (view.width, view.height)[k] - side)) for k in (0, 1))
    return slice(top, top + side), slice(left, left + side)


def landmark_uv(index: int) -> np.ndarray:
    """Return where a landmark lies on a map of the built-in head: column and row [2] as shares of its side."""
    face, bary = template.landmarks()
    head = template.load()
    u, v = (head.uvs[head.face_uvs[face[index]]] * bary[index][:, None]).sum(0)
    return np.array([u, 1 - v])


def sheet(pictures: list[np.ndarray]) -> np.ndarray:
    """Return square pictures in two lines, each TILE wide."""
    tiles = [np.clip(images.resize(np.asarray(picture, np.float32), TILE, TILE), 0, 1) for picture in pictures]
    return in_rows(tiles, (len(tiles) + 1) // 2)


if __name__ == "__main__":
    main()
