# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People in the head's UV space, ready for any light: skin, where hair grows, what each vertex sees of a light stage,
and what reaches each texel of some lamps. All of that is made once per person; colours are varied far beyond the
plausible each time, for a delighter must not take pigment for light.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path

import numpy as np

from ..contract.files import replacing
from ..face import template
from ..geometry import raster
from ..geometry.meshes import vertex_normals
from ..imaging import images
from .olat import LightStage, light_stage, sun_visibility
from .people.figure import paint
from .people.person import sample_person
from .people.shape import person_mesh

SIDE = 512
"""Of the maps."""
LAMPS, RAYS = 8, 6
"""Lamps that a person is prepared for, and rays to each from a texel."""
GROWTH = ("brows", "beard", "hair")


@dataclass(frozen=True)
class UnlitPerson:
    """vertices float32 [V, 3] of the head; visible uint8 [V, LIGHTS / 8], bits: of the light stage; lamps float32
    [LAMPS, 3] unit and radius [LAMPS] of each in radians; reach uint8 [LAMPS, N] of 255: what of each lamp reaches the
    N covered texels of a map of SIDE; skin uint8 [S, S, 3] sRGB between the roots of hair; growth uint8 [S, S,
    len(GROWTH)] of 255."""

    vertices: np.ndarray
    visible: np.ndarray
    lamps: np.ndarray
    radius: np.ndarray
    reach: np.ndarray
    skin: np.ndarray
    growth: np.ndarray

    @property
    def stage(self) -> LightStage:
        mesh = template.load().moved(self.vertices.astype(np.float64))
        return LightStage(mesh, vertex_normals(mesh).astype(np.float32),
                          np.unpackbits(self.visible, axis=1).astype(bool))


def make_person(seed: int) -> UnlitPerson:
    """The person of a seed, some ten seconds' work."""
    rng = np.random.default_rng([seed, 95])
    mesh = person_mesh(seed)
    stage, face, bary = light_stage(mesh), *template_raster(SIDE)
    inside = face >= 0
    points, normals = (raster.interpolate(vectors, mesh.faces, face[inside], bary[inside])
                       for vectors in (mesh.vertices, stage.normals))
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-6)
    lamps, radius = _lamps(rng), np.exp(rng.uniform(np.log(0.004), np.log(0.1), LAMPS))
    caster = raster.RayCaster(mesh)
    reach = np.stack([sun_visibility(caster, points, normals, lamp, r, RAYS, rng)
                      for lamp, r in zip(lamps, radius, strict=True)])
    _, skin, growth = paint(sample_person(seed), SIDE)
    blank = np.zeros((SIDE, SIDE), np.float32)
    grown = np.stack([growth.get(name, blank) for name in GROWTH], -1)
    return UnlitPerson(mesh.vertices.astype(np.float32), np.packbits(stage.visible, axis=1), lamps.astype(np.float32),
                       radius.astype(np.float32),
                  np.round(255 * reach).astype(np.uint8), _bytes(images.linear_to_srgb(skin)), _bytes(grown))


def save(path: Path, person: UnlitPerson) -> None:
    with replacing(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **{field.name: getattr(person, field.name) for field in fields(UnlitPerson)})


def load(path: Path) -> UnlitPerson:
    with np.load(path, allow_pickle=False) as stored:
        return UnlitPerson(**{field.name: stored[field.name] for field in fields(UnlitPerson)})


def _lamps(rng: np.random.Generator) -> np.ndarray:
    """Unit directions [LAMPS, 3]: seldom from behind the person, seldom from below."""
    lamps: list[np.ndarray] = []
    while len(lamps) < LAMPS:
        way = unit(rng.normal(size=3) + [0, -0.5, 0.35])
        if way[1] < 0.5 and way[2] > -0.5:
            lamps.append(way)
    return np.stack(lamps)


@cache
def template_raster(side: int) -> tuple[np.ndarray, np.ndarray]:
    """Which triangle of the built-in head covers each texel [S, S], and where in it [S, S, 3]."""
    return raster.rasterize_uv(template.load(), side)


@cache
def landmarks_in_uv(side: int) -> np.ndarray:
    """Where MediaPipe's landmarks lie in the map, [468, 2] in texels."""
    face, bary = template.landmarks()
    head = template.load()
    uv = (head.uvs[head.face_uvs[face]] * bary[..., None]).sum(1)
    return np.stack([uv[:, 0], 1 - uv[:, 1]], 1) * side


def unit(vectors: np.ndarray) -> np.ndarray:
    return (vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-6)).astype(np.float32)


def _bytes(values: np.ndarray) -> np.ndarray:
    return np.round(255 * np.clip(values, 0, 1)).astype(np.uint8)
