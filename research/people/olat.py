# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A light stage around a synthetic head: which of some hundreds of lights each vertex sees, so that any environment is
a matrix product.

One light at a time (Debevec et al. 2000): light is linear, so skin under an environment is the sum over the lights,
weighted by its radiance. What is as hard as the sun falls between the lights; `trace_sun` casts its rays at every pixel
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
GLOSS = 16  # exponent of the lobe in which the environment shines back: the roughness of skin


@dataclass(frozen=True)
class LightStage:
    """mesh; normals float32 [V, 3] unit; visible bool [V, LIGHTS]: whether light from DIRECTIONS reaches a vertex."""

    mesh: Mesh
    normals: np.ndarray
    visible: np.ndarray


def light_stage(mesh: Mesh) -> LightStage:
    """Rays from every vertex of a mesh to every light before it."""
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
    """float32 [N, LIGHTS]: what each light of radiance 1 adds to the shading of these vertices; a row of an open
    surface adds up to 1."""
    cosine = stage.normals[vertices] @ DIRECTIONS.T.astype(np.float32)
    return np.maximum(cosine, 0) * stage.visible[vertices] * np.float32(4 / LIGHTS)


def mirror_environment(stage: LightStage, vertices: np.ndarray, environment: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """What glossy skin shows of an environment, blocked by the head: a lobe of exponent GLOSS about the mirrored view.
    Times Fresnel's reflectance it adds to the diffuse colour.

    Parameters
    ----------
    stage : the head
    vertices : int [N], of its mesh
    environment : [LIGHTS, 3], linear radiance from DIRECTIONS
    eye : [3], where the camera is, in metres

    Returns
    -------
    float32 [N, 3], linear radiance.
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
    """The share of a disc of light that points see past the head: a denser cone of rays, turned at random per point, so
    that few rays give an even penumbra.

    Parameters
    ----------
    caster : of the head
    points : [N, 3], in metres
    normals : [N, 3], unit
    sun : [3], unit direction to the disc's middle
    radius : of the disc, in radians
    rays : of each point
    rng : turns the cones

    Returns
    -------
    float32 [N] in [0, 1]; 0 where the surface turns away.
    """
    right = np.cross(sun, [0.0, 0.0, 1.0] if abs(sun[2]) < 0.9 else [1.0, 0.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, sun)
    facing = np.flatnonzero(normals @ sun > -0.1)
    origins, turn = points[facing] + LIFT * normals[facing], rng.uniform(0, 2 * np.pi, len(facing))
    seen = np.zeros(len(facing), np.float32)
    for ray in range(rays):
        reach, angle = radius * np.sqrt((ray + 0.5) / rays), turn + ray * np.pi * (1 + 5**0.5)
        directions = sun + reach * (np.cos(angle)[:, None] * right + np.sin(angle)[:, None] * up)
        seen += ~caster.blocked(origins, directions / np.linalg.norm(directions, axis=1, keepdims=True))
    share = np.zeros(len(points), np.float32)
    share[facing] = seen / rays
    return share
