# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A light stage around a head: the lights that each vertex sees, so that any environment is a matrix product.

One light at a time (Debevec et al. 2000): light is linear, so skin under an environment is the sum over the lights,
weighted by its radiance. A light as hard as the sun falls between them; `trace_sun` casts its rays at every pixel
instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.geometry.meshes import Mesh, vertex_normals
from core.geometry.raster import RayCaster
from core.light.skylight import fibonacci_sphere
from core.light.spherical_harmonics import sh_basis

LIGHTS = 256
LIFT = 1e-3  # metres off the surface from which a ray starts
DIRECTIONS = fibonacci_sphere(LIGHTS)
BASIS = sh_basis(DIRECTIONS)


@dataclass(frozen=True)
class LightStage:
    """A head and its lights.

    normals float32 [V, 3] unit; visible bool [V, LIGHTS]: True if light from DIRECTIONS reaches a vertex.
    """

    mesh: Mesh
    normals: np.ndarray
    visible: np.ndarray


def light_stage(mesh: Mesh) -> LightStage:
    """Cast rays from every vertex of a mesh to every light before it."""
    caster, normals = RayCaster(mesh), vertex_normals(mesh)
    visible = np.zeros((len(normals), LIGHTS), bool)
    for i, direction in enumerate(DIRECTIONS):
        # a little beyond, or interpolation would darken the edge of the lit side
        facing = np.flatnonzero(normals @ direction > -0.05)
        visible[facing, i] = ~caster.blocked(
            mesh.vertices[facing] + LIFT * normals[facing], np.repeat(direction[None], len(facing), 0)
        )
    return LightStage(mesh, normals.astype(np.float32), visible)


def transport(stage: LightStage, vertices: np.ndarray) -> np.ndarray:
    """Return the shading float32 [N, LIGHTS] of vertices per light of radiance 1; rows of an open surface sum to 1."""
    cosine = stage.normals[vertices] @ DIRECTIONS.T.astype(np.float32)
    return np.maximum(cosine, 0) * stage.visible[vertices] * np.float32(4 / LIGHTS)


def mirror_environment(stage: LightStage, vertices: np.ndarray, environment: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """Return the environment's reflection in glossy skin, blocked by the head: linear radiance float32 [N, 3].

    A lobe of exponent 16, the roughness of skin, about the mirrored view; times Fresnel's reflectance it adds to the
    diffuse colour. environment [LIGHTS, 3]: linear radiance from DIRECTIONS; eye [3]: the camera, in metres.
    """
    normals = stage.normals[vertices]
    towards = (eye - stage.mesh.vertices[vertices]).astype(np.float32)
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    reflected = 2 * np.einsum("ij,ij->i", normals, towards)[:, None] * normals - towards
    lobe = np.maximum(reflected @ DIRECTIONS.T.astype(np.float32), 0)
    for _ in range(4):  # to the 16th power
        lobe *= lobe
    weight = lobe.sum(1, keepdims=True)
    return (lobe * stage.visible[vertices]) @ environment.astype(np.float32) / np.maximum(weight, 1e-6)


def trace_sun(
    caster: RayCaster,
    points: np.ndarray,
    normals: np.ndarray,
    sun: np.ndarray,
    radius: float,
    rays: int,
    rng: np.random.Generator,
) -> np.ndarray:
    """Return the share float32 [N] in [0, 1] of a disc of light that points see past the head.

    A cone of rays turned at random per point, so that few rays give an even penumbra; 0 where the surface turns away.
    points [N, 3] in metres; normals [N, 3] unit; sun [3]: unit direction to the disc's middle; radius in radians.
    """
    right = np.cross(sun, [0.0, 0.0, 1.0] if abs(sun[2]) < 0.9 else [1.0, 0.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, sun)
    facing = np.flatnonzero(normals @ sun > -0.1)
    origins, turn = points[facing] + LIFT * normals[facing], rng.uniform(0, 2 * np.pi, len(facing))
    free = np.zeros(len(facing), np.float32)
    for ray in range(rays):
        reach, angle = radius * np.sqrt((ray + 0.5) / rays), turn + ray * np.pi * (1 + 5**0.5)
        directions = sun + reach * (np.cos(angle)[:, None] * right + np.sin(angle)[:, None] * up)
        free += ~caster.blocked(origins, directions / np.linalg.norm(directions, axis=1, keepdims=True))
    share = np.zeros(len(points), np.float32)
    share[facing] = free / rays
    return share
