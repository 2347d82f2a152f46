# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Training data of the delighter: photographs of real people, relit."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path

import numpy as np

from core.capture.files import replacing
from core.capture.messages import Reporter
from core.face import template
from core.geometry.meshes import vertex_normals
from core.stages.delight.unet import SIDE_PX

from ..people import london, sight, studio_people
from ..people.olat import LightStage, light_stage
from .portraits import light_twice
from .sights import SightStore


def prepare(store: SightStore, photographs: Path, report: Reporter, processes: int) -> None:
    """Trace the sights of everybody in the folder london_faces who teaches (some ten seconds each).

    All were photographed in one light, which is fitted to all of them; the judges have no part in it.
    """
    paths = {int(path.name[:3]): path for path in london.photographs(photographs)}
    if any(not store.path(number, store.count - 1).is_file() for number in paths):
        light = studio_people.fit_studio_light([studio_people.read_portrait(path) for path in paths.values()])
        store.prepare(list(paths), partial(make_sights, paths=paths, light=light), report, processes)


def make_sights(store: SightStore, number: int, paths: dict[int, Path], light: np.ndarray) -> None:
    """Trace the sights of one person, and the visibility of the light stage, under the studio's light [9, 3]."""
    portrait = studio_people.read_portrait(paths[number])
    stage, rng = light_stage(portrait.mesh), np.random.default_rng([number, 95])
    with replacing(store.path(number, 0).with_name("stage.npz")) as temporary:
        np.savez(temporary, vertices=portrait.mesh.vertices, visible=np.packbits(stage.visible, axis=1))
    for view, shot in enumerate(studio_people.sights(portrait, light, store.count, SIDE_PX, rng)):
        sight.save(store.path(number, view), shot)


def shoot(
    path: Path, rng: np.random.Generator, panoramas: list[np.ndarray], augment: bool = True
) -> Iterator[tuple[np.ndarray, ...]]:
    """Portray a sight under two lights; with `augment`, of another tone than the person's own."""
    return light_twice(sight.full(sight.load(path)), _read_stage(path.parent), rng, panoramas, augment, real=True)


@cache
def _read_stage(folder: Path) -> LightStage:
    with np.load(folder / "stage.npz", allow_pickle=False) as stored:
        mesh = template.load().moved(stored["vertices"])
        visible = np.unpackbits(stored["visible"], axis=1).astype(bool)
    return LightStage(mesh, vertex_normals(mesh).astype(np.float32), visible)
