# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw frame, scan, wireframe of the head and its texture, through the cameras of the capture.

    python -m research.benchmarks.pictures.geometry_pictures .demo/sample.wildcap docs/pictures/geometry.jpg

Pictures of people never go into the documentation.
"""

from pathlib import Path

import cv2
import numpy as np

from core.capture.capture import Capture
from core.geometry import meshes, raster
from core.geometry.views import View, read_views
from core.imaging import images

from ..figures import command_line
from .sheet import write_small

HEIGHT = 480


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("capture", type=Path, help="reconstructed up to its texture, as `make demo` leaves it")
    parser.add_argument("out", type=Path)
    options = parser.parse_args()
    write_small(options.out, sheet(Capture(options.capture)))


def sheet(capture: Capture, views: int = 3) -> np.ndarray:
    """Return a row for leftmost, middle and rightmost views, sRGB [views * HEIGHT, W, 3]; missing parts are grey."""
    head = meshes.read_obj(capture.head) if capture.head.is_file() else None
    scan = meshes.read_ply(capture.scan) if capture.scan.is_file() else None
    texture = images.read_srgb(capture.texture_png) if capture.texture_png.is_file() else None
    casters = {kind: raster.RayCaster(mesh) for kind, mesh in (("scan", scan), ("head", head)) if mesh is not None}
    return np.vstack([_row(view, casters, texture) for view in _spread(read_views(capture), views)])


def _spread(views: list[View], count: int) -> list[View]:
    """Return views from the person's right to the left, evenly spread."""
    ordered = sorted(views, key=lambda view: np.arctan2(-view.axis[0], view.axis[1]))
    return [ordered[i] for i in np.unique(np.linspace(0, len(ordered) - 1, count).round().astype(int))]


def _row(view: View, casters: dict, texture: np.ndarray | None) -> np.ndarray:
    scale = HEIGHT / view.height
    frame = images.resize(view.read(), round(view.width * scale), HEIGHT)
    grey = np.full_like(frame, 0.5)
    scan = _shaded(casters["scan"], view, scale) if "scan" in casters else grey
    wires = _wires(casters["head"].mesh, casters["head"], view, frame, scale) if "head" in casters else grey
    painted = _painted(casters["head"], view, texture, scale) if "head" in casters and texture is not None else grey
    return np.hstack([frame, scan, wires, painted])


def _shaded(caster: raster.RayCaster, view: View, scale: float) -> np.ndarray:
    """Return a mesh in grey, lit from the camera."""
    face, _, _ = raster.render_view(caster, view, scale)
    cosine = np.abs(meshes.face_normals(caster.mesh) @ view.axis)
    return np.repeat(np.where(face >= 0, 0.15 + 0.75 * cosine[np.maximum(face, 0)], 0.95)[..., None], 3, 2).astype(
        np.float32
    )


def _wires(mesh: meshes.Mesh, caster: raster.RayCaster, view: View, frame: np.ndarray, scale: float) -> np.ndarray:
    edges = np.unique(np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    visible = raster.visible_from(caster, mesh.vertices, meshes.vertex_normals(mesh), view.centre)
    pixels = view.project(mesh.vertices)[0] * scale - 0.5
    canvas = np.ascontiguousarray(frame)
    lines = [np.round(line * 16).astype(np.int32) for line in pixels[edges[visible[edges].all(1)]]]
    layer = canvas.copy()
    cv2.polylines(layer, lines, False, (0.2, 0.9, 1.0), 1, cv2.LINE_AA, 4)
    return 0.6 * canvas + 0.4 * layer


def _painted(caster: raster.RayCaster, view: View, texture: np.ndarray, scale: float) -> np.ndarray:
    face, bary, _ = raster.render_view(caster, view, scale)
    uv = raster.interpolate(caster.mesh.uvs, caster.mesh.face_uvs, face, bary)
    at = np.stack([uv[..., 0], 1 - uv[..., 1]], -1).reshape(-1, 2) * len(texture)
    colour = raster.sample(texture, at).reshape(*face.shape, 3)
    return np.where((face >= 0)[..., None], colour, 0.95).astype(np.float32)


if __name__ == "__main__":
    main()
