# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hairs as polylines: roots, growth along and off the skin, clumping.

Cycles draws them as curves, the CPU as slim prisms.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.meshes import Mesh, unit, vertex_normals
from ..geometry.noise import noise


@dataclass(frozen=True)
class Strands:
    """Hairs of one part of the face.

    points float32 [M, K, 3] in metres from the root to the tip; radius float32 [M] in metres at the root, a third of it
    at the tip; colour float32 [M, 3] linear albedo; part: its name among parts.PARTS.
    """

    points: np.ndarray
    radius: np.ndarray
    colour: np.ndarray
    part: str

    def taper(self) -> np.ndarray:
        """Return radii [M, K] in metres."""
        return self.radius[:, None] * np.linspace(1, 1 / 3, self.points.shape[1], dtype=np.float32)


@dataclass(frozen=True)
class Roots:
    """Roots of hairs.

    position [M, 3] in metres, normal and direction [M, 3] unit, at [M, 3] the same places on the template in
    millimetres.
    """

    position: np.ndarray
    normal: np.ndarray
    direction: np.ndarray
    at: np.ndarray

    def of(self, chosen: np.ndarray) -> Roots:
        return Roots(self.position[chosen], self.normal[chosen], self.direction[chosen], self.at[chosen])


class SkinSurface:
    """Skin that hairs may not enter, represented by the nearest of a mesh's vertices."""

    def __init__(self, mesh: Mesh):
        self.vertices, self.normals = mesh.vertices, vertex_normals(mesh)
        self.tree = cKDTree(mesh.vertices)

    def height(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the height [N] in metres of points [N, 3] above the skin, and its normals there [N, 3]."""
        distance, near = self.tree.query(points, 3)
        weight = 1 / (distance + 1e-4)
        weight /= weight.sum(1, keepdims=True)
        normal = unit((weight[..., None] * self.normals[near]).sum(1))
        foot = (weight[..., None] * self.vertices[near]).sum(1)
        return ((points - foot) * normal).sum(1), normal


def grow(
    roots: Roots,
    length: np.ndarray,
    lift: np.ndarray,
    skin: SkinSurface,
    pull: np.ndarray,
    clearance: np.ndarray,
    steps: int,
) -> np.ndarray:
    """Grow M hairs, float32 [M, steps, 3] in metres, along their roots' directions and bending on the way.

    length [M] in metres; lift [M], radians between the skin and the hair at its root; pull [M, 3] or [3] bends a hair,
    per its length; clearance [M], metres to keep from the skin, less near the root.
    """
    lift = lift[:, None]
    way = np.cos(lift) * roots.direction + np.sin(lift) * roots.normal
    step = length[:, None] / (steps - 1)
    points = [roots.position]
    for k in range(1, steps):
        way = way + np.broadcast_to(pull, way.shape) / (steps - 1)
        way = unit(way)
        point = points[-1] + way * step
        height, normal = skin.height(point)
        short = np.maximum(clearance * min(1.0, 3 * k / (steps - 1)) - height, 0)[:, None]
        point = point + short * normal
        inward = np.minimum((way * normal).sum(1, keepdims=True), 0)
        way = np.where(short > 0, way - 0.9 * inward * normal, way)
        points.append(point)
    return np.stack(points, 1).astype(np.float32)


def clumped(points: np.ndarray, group_size: int, strength: float, rng: np.random.Generator) -> np.ndarray:
    """Draw hairs [M, K, 3] towards one in `group_size` of them, more towards the tip; strength in [0, 1]."""
    if len(points) < 2 * group_size:
        return points
    leaders = rng.choice(len(points), len(points) // group_size, replace=False)
    leader = leaders[cKDTree(points[leaders, 0]).query(points[:, 0])[1]]
    along = np.linspace(0, 1, points.shape[1], dtype=np.float32)[None, :, None]
    share = strength * rng.uniform(0.4, 1.0, (len(points), 1, 1)).astype(np.float32) * along**1.3
    return points * (1 - share) + points[leader] * share


def waved(
    points: np.ndarray,
    at: np.ndarray,
    amplitude: float,
    wavelength_mm: float,
    rng: np.random.Generator,
    alone: float = 0.35,
) -> np.ndarray:
    """Bend hairs [M, K, 3] aside, neighbours alike: float32, in metres.

    at [M, 3] are the roots in mm; amplitude is metres aside at the tip; neighbours within wavelength_mm are alike, but
    for the share `alone` by which each goes its own way.
    """
    along = np.linspace(0, 1, points.shape[1], dtype=np.float32)[None, :, None]
    length = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(1)[:, None, None]
    out = points
    for turn, share in ((1.0, 1.0), (2.3, 0.45)):
        phase = 2 * noise(at, wavelength_mm, rng)[:, None, None] + alone * rng.normal(size=(len(points), 1, 1))
        shared = np.stack([noise(at, 1.5 * wavelength_mm, rng) for _ in range(3)], 1)
        aside = shared + alone * rng.normal(size=(len(points), 3))
        curl = np.sin(2 * np.pi * turn * along * np.clip(length / 0.05, 0.4, 3) + phase)
        out = out + share * amplitude * along * curl * aside[:, None]
    return out.astype(np.float32)


def coloured(count: int, colour: np.ndarray, grey: float, rng: np.random.Generator) -> np.ndarray:
    """Draw linear albedos [count, 3] of hairs around one colour [3]; `grey` is the share without pigment."""
    shade = np.exp(rng.normal(0, 0.22, (count, 1)) + rng.normal(0, 0.05, (count, 3)))
    white = np.array([0.42, 0.40, 0.37]) * np.exp(rng.normal(0, 0.15, (count, 1)))
    return np.where(rng.random((count, 1)) < grey, white, np.clip(colour * shade, 0.003, 0.8)).astype(np.float32)


def prisms(strands: Strands, sides: int = 3) -> Mesh:
    """Turn hairs into prisms without caps, for a CPU's rays.

    Triangle t belongs to hair t // (2 sides (K - 1)).
    """
    points, radius = strands.points.astype(np.float64), strands.taper().astype(np.float64)
    count, knots = points.shape[:2]
    way = unit(np.gradient(points, axis=1))
    across = np.cross(way, np.where(np.abs(way[..., 2:]) < 0.9, [0, 0, 1.0], [1.0, 0, 0]))
    across = unit(across)
    other = np.cross(way, across)
    turn = 2 * np.pi * np.arange(sides) / sides
    ring = np.cos(turn)[:, None] * across[:, :, None] + np.sin(turn)[:, None] * other[:, :, None]  # [M, K, sides, 3]
    vertices = points[:, :, None] + radius[:, :, None, None] * ring
    k, s = np.meshgrid(np.arange(knots - 1), np.arange(sides), indexing="ij")
    a, b, c, d = k * sides + s, k * sides + (s + 1) % sides, (k + 1) * sides + s, (k + 1) * sides + (s + 1) % sides
    first_hair = np.stack([np.stack([a, c, b], -1), np.stack([b, c, d], -1)], 2).reshape(-1, 3)
    faces = (np.arange(count)[:, None, None] * knots * sides + first_hair).reshape(-1, 3)
    return Mesh(vertices.reshape(-1, 3), faces)
