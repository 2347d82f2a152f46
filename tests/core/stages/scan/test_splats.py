# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Gaussian splatting on tiny pictures with a plain rasteriser: training moves surfels onto the surface that the
pictures show."""

import numpy as np
import pytest
import torch

from core.geometry.meshes import Mesh
from core.geometry.raster import RayCaster, interpolate
from core.stages.scan import splats
from core.stages.scan.fusion import fuse
from tests.fixtures.plain_splatting import rasterization_2dgs
from tests.fixtures.refused import refused

SIDE, FOCAL, RADIUS = 24, 102.0, 1.0
"""Pictures of 70 mm of a large ball's front, from 0.3 m, 2.9 mm a pixel."""
POLE = np.array([0.0, -RADIUS, 0.0])


def patch(radius: float, columns: int, reach: float) -> Mesh:
    """The front of a ball, a grid over `reach` radians to each side."""
    across, up = np.meshgrid(np.linspace(-reach, reach, columns), np.linspace(-reach, reach, columns))
    points = np.stack([np.sin(across) * np.cos(up), -np.cos(across) * np.cos(up), np.sin(up)], -1)
    points = radius * points.reshape(-1, 3)
    index = np.arange(columns**2).reshape(columns, columns)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]))
    return Mesh(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def photograph(yaw: float, pitch: float) -> tuple[splats.UndistortedFrame, np.ndarray]:
    """The painted front, and its true depth."""
    yaw, pitch = np.radians(yaw), np.radians(pitch)
    centre = POLE + 0.3 * np.array([np.sin(yaw) * np.cos(pitch), -np.cos(yaw) * np.cos(pitch), np.sin(pitch)])
    z = (POLE - centre) / np.linalg.norm(POLE - centre)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z])
    rows, columns = np.mgrid[0:SIDE, 0:SIDE]
    origin = np.array([-SIDE / 2, -SIDE / 2])
    rays = np.stack(
        [(columns.ravel() + 0.5 + origin[0]) / FOCAL, (rows.ravel() + 0.5 + origin[1]) / FOCAL, np.ones(SIDE * SIDE)],
        -1,
    )
    length = np.linalg.norm(rays, axis=1)
    mesh = patch(RADIUS, 100, 0.07)
    face, bary, distance = RayCaster(mesh).first_hits(
        np.repeat(centre[None], len(rays), 0), rays / length[:, None] @ rotation
    )
    points = interpolate(mesh.vertices, mesh.faces, face, bary)
    hit = (face >= 0).reshape(SIDE, SIDE)
    colour = 0.5 + 0.22 * np.stack([np.sin(points @ w) for w in ([330, 0, 150], [-150, 0, 300], [200, 0, -280])], -1)
    picture = np.where(hit[..., None], colour.reshape(SIDE, SIDE, 3), 0.9).astype(np.float32)  # a white wall behind
    depth = np.where(hit, (distance / length).reshape(SIDE, SIDE), np.nan)
    return splats.UndistortedFrame(rotation, centre, FOCAL, origin, picture, hit), depth


@pytest.fixture(scope="module")
def seen():
    return [photograph(yaw, pitch) for yaw, pitch in ((-25, 0), (-12, 12), (0, -15), (12, 12), (25, 0), (0, 20))]


def start_of() -> Mesh:
    """The front of the ball, rough, and with a swell of 4 mm."""
    mesh = patch(RADIUS, 26, 0.044)
    x, _, z = mesh.vertices.T
    off = np.random.default_rng(0).normal(0, 0.0008, len(x)) + 0.004 * np.exp(-(x**2 + z**2) / 0.012**2)
    return mesh.moved(mesh.vertices * (1 + off / RADIUS)[:, None])


def errors_of(maps, seen) -> float:
    """Mean absolute depth error [m] in the middle of the pictures."""
    inner = np.s_[5:-5, 5:-5]
    gaps = [np.abs(found.depth - depth)[inner] for found, (_, depth) in zip(maps, seen, strict=True)]
    return float(np.nanmean(gaps))


def test_training_lowers_the_depth_error(seen):
    torch.manual_seed(0)
    photographs = [p for p, _ in seen]
    losses, start = [], start_of()
    before = splats.train(start, photographs, rasterization_2dgs, "cpu", 0)
    after = splats.train(start, photographs, rasterization_2dgs, "cpu", 45, lambda step, loss: losses.append(loss))
    assert errors_of(before, seen) > 0.001
    assert errors_of(after, seen) < 0.65 * errors_of(before, seen)
    assert np.mean(losses[-10:]) < 0.7 * np.mean(losses[:10])
    fused = fuse(after, np.array([[-0.05, -1.03, -0.05], [0.05, -0.96, 0.05]]), 0.003)
    distance = np.linalg.norm(fused.mesh.vertices, axis=1)
    assert np.median(np.abs(distance - RADIUS)) < 0.0015, "the same fusion makes a scan of them"


def test_splats_without_a_gpu_are_a_problem_only_when_asked_for():
    assert not splats.use_splats("auto", "cpu") and not splats.use_splats("stereo", "cuda")
    refused(lambda: splats.use_splats("splats", "cpu"), "gsplat")
