# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Light baked into the template's UV space with known truth.

A smooth sky with its ambient occlusion, and a sun whose hard or soft shadows the head itself, leaves, blinds or a
roof's edge cast. The sky is precomputed radiance transfer in second-order spherical harmonics (Sloan, Kautz and Snyder
2002); 1 is a white surface's light.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from core.face import template
from core.geometry import raster
from core.geometry.meshes import Mesh, unit, vertex_normals
from core.geometry.noise import noise
from core.light.skylight import radiance_transfer
from core.light.spherical_harmonics import LAMBERT, UNIFORM, per_function, sh_basis

TRANSFER_RAYS = 192  # of each point, for the sky
SUN_RAYS = 20  # of each point, over the sun's disc


@dataclass(frozen=True)
class SkyAndSun:
    """A sky and a sun.

    sky [9, 3]: coefficients of its radiance; sun [3]: unit direction to it; colour [3]: shading of a surface that faces
    it, zeros for no sun; radius of the sun in radians.
    """

    sky: np.ndarray
    sun: np.ndarray
    colour: np.ndarray
    radius: float


def random_light(rng: np.random.Generator) -> SkyAndSun:
    """Draw broad lights from anywhere but below, and a sun before the face."""
    sky = np.zeros((9, 3))
    for _ in range(4):  # broad lights from anywhere but below
        towards = rng.normal(size=3) * [1, 1, 0.6] + [0, -0.3, 0.5]
        tint = np.exp(rng.normal(0, 0.15, 3)) * rng.uniform(0.1, 0.5)
        sky += (sh_basis(towards / np.linalg.norm(towards)) * per_function(LAMBERT))[:, None] * tint
    sky[0] += 0.2 * UNIFORM * np.exp(rng.normal(0, 0.1, 3))  # keeps the radiance positive
    azimuth, elevation = rng.uniform(-1.0, 1.0), rng.uniform(0.1, 1.2)
    sun = np.array([np.sin(azimuth) * np.cos(elevation), -np.cos(azimuth) * np.cos(elevation), np.sin(elevation)])
    warmth = rng.uniform(0, 1)
    colour = rng.uniform(0.5, 2.0) * np.array([1.0, 1 - 0.15 * warmth, 1 - 0.4 * warmth])
    return SkyAndSun(sky, sun, colour, float(np.exp(rng.uniform(np.log(0.005), np.log(0.12)))))


def bake(
    mesh: Mesh, size: int, light: SkyAndSun, shadows: str, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bake a light into a mesh's UVs, bled beyond the charts.

    shadows: their cause, one of none, self (the mesh alone), leaves, blinds, edge. Returns shading [S, S, 3], the
    blocked share [S, S] of the sun where the surface faces it, and world normals [S, S, 3].
    """
    face, bary = raster.rasterize_uv(mesh, size)
    covered = face >= 0
    face, bary = face[covered], bary[covered]
    points = raster.interpolate(mesh.vertices, mesh.faces, face, bary)
    normals = unit(raster.interpolate(vertex_normals(mesh), mesh.faces, face, bary))
    caster = raster.RayCaster(mesh)
    ambient = raster.interpolate(_transfer_of(mesh, caster) @ light.sky, mesh.faces, face, bary)
    free = _sun_seen(caster, points, normals, light, shadows, rng)
    cosine = np.maximum(normals @ light.sun, 0)
    shading = np.maximum(ambient, 0.005) + (cosine * free)[:, None] * light.colour
    shadow = np.where(cosine > 0.02, 1 - free, 0) * (light.colour.sum() > 0)

    def spread(texel_values: np.ndarray) -> np.ndarray:
        picture = np.zeros((size, size, *texel_values.shape[1:]), np.float32)
        picture[covered] = texel_values
        return raster.bleed(picture, covered)

    return spread(shading), spread(shadow), spread(normals)


def _sun_seen(
    caster: raster.RayCaster,
    points: np.ndarray,
    normals: np.ndarray,
    light: SkyAndSun,
    shadows: str,
    rng: np.random.Generator,
) -> np.ndarray:
    """Return the share [N] of the sun's disc that each point sees past the head and past what else casts a shadow."""
    if shadows == "none":
        return np.ones(len(points))
    sun, radius = light.sun, light.radius
    right = np.cross(sun, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, sun)
    turn, reach = rng.uniform(0, 2 * np.pi), np.sqrt((np.arange(SUN_RAYS) + 0.5) / SUN_RAYS) * radius
    spiral = np.pi * (1 + 5**0.5) * np.arange(SUN_RAYS) + turn
    directions = unit(sun + (reach * np.cos(spiral))[:, None] * right + (reach * np.sin(spiral))[:, None] * up)
    free = np.zeros((SUN_RAYS, len(points)), np.float32)
    facing = np.flatnonzero(normals @ sun > 0)
    for ray, direction in enumerate(directions):
        free[ray, facing] = ~caster.blocked(
            points[facing] + 1e-3 * normals[facing], np.repeat(direction[None], len(facing), 0)
        )
    if shadows != "self":
        away = rng.uniform(0.25, 1.0)  # metres to what throws the shadow
        at = points[None, facing] + away * directions[:, None]
        free[:, facing] *= 1 - draw_sheet(at @ right, at @ up, away * radius * 2 / SUN_RAYS**0.5, shadows, rng)
    share = np.zeros(len(points))
    share[facing] = free[:, facing].mean(0)
    return share


def draw_sheet(x: np.ndarray, y: np.ndarray, blur: float, kind: str, rng: np.random.Generator) -> np.ndarray:
    """Return the cover [...] in [0, 1] of an opaque sheet with random holes across the sunlight, at places x, y [...].

    x, y and blur, the width of the sheet's edges, are in metres; where rays are cast, blur is the distance between two
    of them there, so that few make an even penumbra. kind: edge or blinds; leaves otherwise.
    """
    turn, shift = rng.uniform(0, np.pi), rng.uniform(-0.05, 0.05)
    along = (x - x.mean()) * np.cos(turn) + (y - y.mean()) * np.sin(turn) + shift
    if kind == "edge":
        inside = along
    elif kind == "blinds":
        period, share = rng.uniform(0.03, 0.09), rng.uniform(0.3, 0.6)
        inside = period * (share / 2 - np.abs((along / period) % 1 - 0.5))  # metres into the slat
    else:
        wavelength = rng.uniform(18, 60)
        flat = np.stack([x.ravel() * 1000, y.ravel() * 1000, np.zeros(x.size)], -1)
        leaves = noise(flat, wavelength, rng, smooth=True) + 0.35 * noise(flat, 9.0, rng, smooth=True)
        # about metres: over the noise's usual slope
        inside = ((leaves - rng.uniform(-0.4, 0.5)) * wavelength * 0.4e-3).reshape(x.shape)
    return np.clip(0.5 + inside / max(blur, 1e-4), 0, 1)


@cache
def sky_transfer() -> np.ndarray:
    """Return the built-in head's transfer per vertex [V, 9]; computed once per process."""
    mesh = template.load()
    return radiance_transfer(raster.RayCaster(mesh), mesh.vertices, vertex_normals(mesh), TRANSFER_RAYS)


def _transfer_of(mesh: Mesh, caster: raster.RayCaster) -> np.ndarray:
    """Return the transfer per vertex [V, 9]; the template's is computed once per process."""
    same = template.load()
    if mesh.vertices.shape == same.vertices.shape and np.array_equal(mesh.vertices, same.vertices):
        return sky_transfer()
    return radiance_transfer(caster, mesh.vertices, vertex_normals(mesh), TRANSFER_RAYS)
