# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The built-in head, painted with a known texture and seen by known cameras: the texture stage's known answer."""

import json

import numpy as np
import pycolmap

from core.capture.capture import Capture
from core.face import template
from core.geometry import meshes, raster
from core.geometry.meshes import Mesh
from core.geometry.views import read_views
from core.imaging import images

WIDTH, HEIGHT, FOCAL = 300, 400, 520.0


def head() -> Mesh:
    """The built-in head, its middle at the origin."""
    mesh = template.load()
    return mesh.moved(mesh.vertices - (mesh.vertices.min(0) + mesh.vertices.max(0)) / 2)


def skin(size: int, seed: int = 0) -> np.ndarray:
    """A linear texture [S, S, 3]: patches of tone, fine pores, values in about 0.1 to 0.6."""
    rng = np.random.default_rng(seed)

    def noise(cells):
        return images.resize(rng.normal(size=(cells, cells, 1)).astype(np.float32), size, size).reshape(size, size, 1)

    tone = np.array([0.42, 0.27, 0.20], np.float32)
    return np.clip(tone * np.exp(0.15 * noise(6) + 0.08 * noise(size // 4)), 0.02, 0.9).astype(np.float32)


def capture_of(
    root, texture: np.ndarray, azimuths_deg, distort=lambda i, picture: picture, light=None, distance: float = 0.5
) -> Capture:
    """A capture up to the delit frames: one camera per azimuth (0 in front, positive on the person's left), at eye
    height.

    `distort(i, picture)` changes the linear picture of camera i before it is stored. With `light` (texture-like,
    linear), which falls on the paint, the frames that were filmed are there too.
    """
    capture, mesh = Capture(root), head()
    names = [f"{i:05d}.jpg" for i in range(len(azimuths_deg))]
    capture.frames.mkdir(parents=True)
    frames = [
        {"name": n, "video_frame": i, "time_s": i / 24, "sharpness": 1.0, "selected": True} for i, n in enumerate(names)
    ]
    capture.frames_json.write_text(json.dumps({"frames": frames}))
    write_cameras(capture.cameras, names, azimuths_deg, distance)
    meshes.write_obj(capture.head, mesh)
    caster = raster.RayCaster(mesh)
    for i, view in enumerate(read_views(capture)):
        if light is not None:
            images.write_srgb(view.path, images.linear_to_srgb(photograph(caster, view, texture * light)), quality=98)
        images.write_srgb(
            (capture.delit / view.name).with_suffix(".png"),
            images.linear_to_srgb(distort(i, photograph(caster, view, texture))),
            16,
        )
    return capture


def write_cameras(folder, names, azimuths_deg, distance: float = 0.5, height: float = 0.0) -> None:
    """A COLMAP model of cameras on a circle around the origin, looking at it."""
    model = pycolmap.Reconstruction()
    model.add_camera_with_trivial_rig(
        pycolmap.Camera(
            camera_id=1, model="PINHOLE", width=WIDTH, height=HEIGHT, params=[FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2]
        )
    )
    for i, (name, azimuth) in enumerate(zip(names, np.radians(azimuths_deg), strict=True)):
        centre = np.array([np.sin(azimuth) * distance, -np.cos(azimuth) * distance, height])
        forward = -centre / np.linalg.norm(centre)
        right = np.cross(forward, [0, 0, 1])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        pose = pycolmap.Rigid3d(np.concatenate([rotation, (-rotation @ centre)[:, None]], 1))
        model.add_image_with_trivial_frame(pycolmap.Image(name=name, camera_id=1, image_id=i + 1), pose)
    folder.mkdir(parents=True)
    model.write(str(folder))


def photograph(caster: raster.RayCaster, view, texture: np.ndarray, over: int = 2) -> np.ndarray:
    """The painted mesh through a camera, linear [H, W, 3], black background; `over` samples per pixel's side."""
    face, bary, _ = raster.render_view(caster, view, over)
    uv = raster.interpolate(caster.mesh.uvs, caster.mesh.face_uvs, face, bary)
    at = np.stack([uv[..., 0], 1 - uv[..., 1]], -1).reshape(-1, 2) * len(texture)
    colour = raster.sample(texture, at).reshape(*face.shape, 3) * (face >= 0)[..., None]
    return images.resize(colour, view.width, view.height)
