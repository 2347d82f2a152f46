# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A person before a busy wall, photographed by known cameras without a renderer, for tests of cameras.

World: metres, +Z up, the face towards -Y. Azimuth 0 is in front, positive on the person's left.
"""

from dataclasses import replace
from functools import cache

import cv2
import numpy as np

from core.geometry import meshes, raster
from core.geometry.views import View
from core.imaging import images

from .cameras import pinhole_view
from .identities import subject_mesh
from .parameters import sample_parameters
from .skin import make_skin

WIDTH, HEIGHT, FOCAL = 300, 400, 467.0
WALL_M, WALL_AT = 6.0, 1.2
SEED = 5


@cache
def person(seed: int = SEED, texels: int = 256) -> tuple[raster.RayCaster, np.ndarray, np.ndarray]:
    """Return the head's ray caster, its vertex normals, and its linear diffuse albedo [texels, texels, 3]."""
    mesh = subject_mesh(seed)
    return raster.RayCaster(mesh), meshes.vertex_normals(mesh), make_skin(sample_parameters(seed), texels).diffuse


def place_camera(
    azimuth_deg: float, height: float = 0.0, distance: float = 0.55, target=(0, -0.01, -0.035), scale: float = 1.0
) -> View:
    """Return a camera that looks at the head, which it shows equally large from any distance.

    height in metres above the eyes; distance in metres from the head's axis; target [3] in metres; scale of WIDTH x
    HEIGHT.
    """
    a = np.radians(azimuth_deg)
    centre, target = np.array([np.sin(a) * distance, -np.cos(a) * distance, height]), np.array(target)
    z = (target - centre) / np.linalg.norm(target - centre)
    x = np.cross(z, [0, 0, 1])
    x /= np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z])
    size = round(WIDTH * scale), round(HEIGHT * scale)
    middle = np.array([WIDTH / 2, HEIGHT / 2]) * scale
    return pinhole_view(size, FOCAL * distance / 0.55 * scale, middle, rotation, -rotation @ centre)


def studio(scale: float = 1.0) -> list[View]:
    """Return sixteen cameras a metre away in two rows over 100 degrees, as in multi-view studios (NeRSemble)."""
    return [
        place_camera(azimuth, height, 1.0, scale=scale)
        for height in (-0.15, 0.25)
        for azimuth in np.linspace(-50, 50, 8)
    ]


def photograph(
    view: View,
    turned_deg: float = 0.0,
    wall: bool = True,
    even: bool = False,
    seed: int = SEED,
    texels: int = 256,
) -> np.ndarray:
    """Photograph the person before a wall, or before grey; sRGB [H, W, 3].

    The head is turned by `turned_deg` to the person's left while light and wall stay; even: light from everywhere;
    texels: side of the albedo.
    """
    caster, normals, albedo = person(seed, texels)
    turn = np.radians(turned_deg)
    rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    # the camera in the head's axes
    face, bary, _ = raster.render_view(caster, replace(view, rotation=view.rotation @ rotation), 2)
    hit = face >= 0  # what lies beside the head need not be worked out
    face, bary = face[hit], bary[hit]
    uv = raster.interpolate(caster.mesh.uvs, caster.mesh.face_uvs, face, bary)
    colour = raster.sample_uv(albedo, uv)
    normal = raster.interpolate(normals, caster.mesh.faces, face, bary) @ rotation.T
    shade = np.full(len(face), 0.9)
    if not even:
        shade = 0.55 + 0.45 * np.clip(normal @ (np.array([0.3, -0.8, 0.5]) / 0.99), 0, 1)
    lit = np.zeros((*hit.shape, 3), np.float32)
    lit[hit] = colour * (shade * 1.6)[:, None]
    head = images.resize(lit, view.width, view.height)
    cover = images.resize(hit.astype(np.float32), view.width, view.height)[..., None]
    return images.linear_to_srgb(head * (cover > 0) + (1 - cover) * (_wall(view) if wall else 0.3))


@cache
def _paper() -> np.ndarray:
    rng = np.random.default_rng(0)
    coarse, fine = rng.random((60, 60, 3), np.float32), rng.random((240, 240, 3), np.float32)
    return np.clip(0.5 * images.resize(coarse, 1200, 1200) + 0.5 * images.resize(fine, 1200, 1200), 0.02, 1) ** 2


def _wall(view: View) -> np.ndarray:
    """Return the wall behind the person, in the plane y = WALL_AT, linear [H, W, 3]."""
    x, y = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    rays = view.rays(np.stack([x, y], -1).reshape(-1, 2))
    with np.errstate(divide="ignore"):
        reach = (WALL_AT - view.centre[1]) / rays[:, 1]
    hit = view.centre + rays * np.where(reach > 0, reach, 0)[:, None]
    at = ((hit[:, [0, 2]] / WALL_M + 0.5) % 1 * 1200).astype(np.float32)
    column, row = (at[:, k].reshape(y.shape) for k in range(2))
    return cv2.remap(_paper(), column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
