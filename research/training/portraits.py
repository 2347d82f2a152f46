# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Training data of the delighter: bald subjects on the light stage, seen from many sides, lit anew for every step."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import torch
from safetensors.torch import load_file

from core.capture.files import replacing
from core.capture.messages import Reporter
from core.geometry.meshes import vertex_normals
from core.imaging import images
from core.stages.delight.unet import FARTHEST_LOG, SIDE_PX, network_input
from core.stages.solve.prior_files import WEIGHTS

from ..people import sight
from ..people.identities import subject_mesh
from ..people.lifelike.markings import moles, stains, tufts
from ..people.olat import LightStage, light_stage
from ..people.portrait import Portrait, relight_sight, sample_sight
from ..people.skin import Skin
from .sights import SightStore
from .skins import Skins, carried_skins, synthetic_skins

WITH_GEOMETRY = 0.55
"""Share of the pictures whose geometry goes into the network; single photographs have none."""
SLIP_PX = 0.8, 2.0
"""How far the head lies off its picture, in pixels of the network's square (standard deviation along each axis): one
registered to a film, and one fitted to the landmarks of a single photograph."""
FROM_LANDMARKS = 0.4  # share of the latter
LEAST = 0.01  # shading of which the logarithm is learnt; below is noise
LEAST_WEIGHT = 0.25  # of what is no part of the face, beside its 1
CARRIED = 0.35
"""Share of the subjects that wear a carried skin, if there are any."""


class PortraitBatch(NamedTuple):
    """Portraits, of which 2 k and 2 k + 1 are the same sight under two lights.

    layers [N, CHANNELS, SIDE, SIDE]; of the same size: shading (3), the true log-shading less the picture's middle,
    weight (1) of its error, shadow (1) and shadow_weight (1). real [N, 1, 1, 1]: 1 for photographs of real people,
    whose albedo is not known in the large.
    """

    layers: torch.Tensor
    shading: torch.Tensor
    weight: torch.Tensor
    shadow: torch.Tensor
    shadow_weight: torch.Tensor
    real: torch.Tensor


def shoot(
    path: Path, rng: np.random.Generator, panoramas: list[np.ndarray], augment: bool = True
) -> Iterator[tuple[np.ndarray, ...]]:
    """Portray a sight under two lights; with `augment`, of another tone than the subject's own."""
    return light_twice(sight.full(sight.load(path)), _read_stage(path.parent), rng, panoramas, augment)


def light_twice(
    view: sight.Sight,
    stage: LightStage,
    rng: np.random.Generator,
    panoramas: list[np.ndarray],
    augment: bool = True,
    real: bool = False,
) -> Iterator[tuple[np.ndarray, ...]]:
    """Portray a sight of a head under two lights; with `augment`, of another tone than its own."""
    albedo = view.albedo
    if augment:
        gain = np.exp(rng.normal(0, 0.12) + rng.normal(0, 0.04, 3))
        albedo = np.clip(albedo * gain, 0.003, 0.9).astype(np.float32)
    for _ in range(2):
        lit = relight_sight(view, stage, rng, panoramas, albedo)
        normal = lit.fitted.normal @ view.rotation.T.astype(np.float32)
        there = np.ones(len(view.pixel), np.float32)
        maps = map(view.picture, (lit.fitted.ambient, lit.fitted.sunlit, normal, there))
        yield make_example(lit, tuple(maps), rng, real)


@cache
def _read_stage(folder: Path) -> LightStage:
    """Read the light stage of a subject, whose seed ends the folder's name."""
    mesh = subject_mesh(int(folder.name.rpartition("_")[2]))
    visible = np.unpackbits(np.load(folder / "visible.npy"), axis=1).astype(bool)
    return LightStage(mesh, vertex_normals(mesh).astype(np.float32), visible)


def make_example(
    portrait: Portrait, geometry_maps: tuple[np.ndarray, ...], rng: np.random.Generator, real: bool = False
) -> tuple[np.ndarray, ...]:
    """Return the arrays of a PortraitBatch for one portrait.

    geometry_maps: ambient, sunlit and normal [S, S, 3] (camera coordinates) of the registered head, and where it is
    [S, S]. Every part of the face has weight: skin, brows, beard, lips, eyes.
    """
    geometry = ()
    if rng.random() < WITH_GEOMETRY:
        off = SLIP_PX[int(rng.random() < FROM_LANDMARKS)]
        slip = np.float32([[1, 0, rng.normal(0, off)], [0, 1, rng.normal(0, off)]])
        geometry = [
            cv2.warpAffine(np.ascontiguousarray(array, np.float32), slip, (len(array), len(array)))
            for array in geometry_maps
        ]
    layers, middle = network_input(portrait.srgb, *geometry)
    sure = (portrait.head > 0.99) & (portrait.albedo.min(-1) > 0.002)
    shading = np.log(np.maximum(portrait.even, LEAST)) - middle
    elsewhere = 0.0 if real else LEAST_WEIGHT
    weight = sure * (elsewhere + (1 - elsewhere) * portrait.face)
    strong = portrait.strong
    trust = 1.0 if strong > 0.4 or strong < 0.1 else 0.3  # in between it is a matter of taste what is a shadow
    shadow = portrait.shadow[None] * (strong > 0.2)
    flag = np.full((1, 1, 1), real)
    parts = layers, shading.transpose(2, 0, 1), weight[None], shadow, (sure * trust)[None], flag
    return tuple(np.ascontiguousarray(array, np.float32) for array in parts)


def mirrored(batch: PortraitBatch) -> PortraitBatch:
    """Exchange left and right; a normal's x changes its sign."""
    batch = batch._make(part.flip(-1) for part in batch)  # a copy
    batch.layers[:, 12] *= -1
    return batch


def repainted(batch: PortraitBatch, rng: np.random.Generator) -> PortraitBatch:
    """Paint stains, moles and tufts over the skin, on both pictures of a sight alike.

    The shading stays what it was, but for the picture's middle.
    """
    layers, shading, side = batch.layers.clone(), batch.shading.clone(), batch.layers.shape[-1]
    skin = ((batch.weight - LEAST_WEIGHT) / (1 - LEAST_WEIGHT)).clamp(0, 1).numpy()[:, 0, ..., None]
    for first in range(0, len(layers), 2):
        paint = _paint(side, rng)
        for k in (first, first + 1):
            srgb = (layers[k, :3].numpy().transpose(1, 2, 0) + 1) / 2
            painted = np.clip(images.srgb_to_linear(srgb) * np.exp(skin[k] * paint), 0, 1)
            (before, middle), (after, moved) = (
                network_input(picture) for picture in (srgb, images.linear_to_srgb(painted))
            )
            change = torch.from_numpy(after[3:6] + moved - before[3:6] - middle)
            layers[k, :6] = torch.from_numpy(after[:6])
            for light in (6, 9):  # what is left of the logarithm under the fitted light
                rest = (layers[k, light : light + 3] + change).clamp(-FARTHEST_LOG, FARTHEST_LOG)
                layers[k, light : light + 3] = rest * layers[k, 15]
            shading[k] += middle - moved
    return batch._replace(layers=layers, shading=shading)


def _paint(side: int, rng: np.random.Generator) -> np.ndarray:
    """Draw what a skin is painted with, [side, side, 3] as logarithms."""
    face = np.array([[0.2, 0.2], [0.8, 0.85]]) * side  # about where it is in its square
    log = np.zeros((side, side, 3), np.float32)
    for make, odds in ((stains, 0.6), (moles, 0.5), (partial(tufts, landmarks=face), 0.5)):
        if rng.random() < odds:
            log += make(side, rng=rng)
    return log


def make_sights(store: SightStore, seed: int, skins: Path | None = None, names: list[str] = ()) -> None:
    """Trace the sights of one subject, and the visibility of the light stage (some seconds each).

    skins: folder of carried skins; names: those of them of which the subject may wear one.
    """
    silent, rng = Reporter("train"), np.random.default_rng([seed, 50])
    own = synthetic_skins([seed], store.work, silent)
    skin = _skin(own)
    if names and rng.random() < CARRIED:
        mean = load_file(WEIGHTS)["mean_face"].float()
        skin = _wear(skin, own, carried_skins(skins, [str(rng.choice(names))], mean, store.work, silent))
    stage = light_stage(subject_mesh(seed))
    with replacing(store.path(seed, 0).with_name("visible.npy")) as temporary:
        np.save(temporary, np.packbits(stage.visible, axis=1))
    for view in range(store.count):
        shot = sample_sight(stage, skin, np.random.default_rng([seed, 51, view]), SIDE_PX)
        sight.save(store.path(seed, view), shot)


def _skin(skins: Skins) -> Skin:
    """Return the only skin of `skins` as the generator's own type; height is not needed."""
    maps = skins.maps[1][0].float().numpy().transpose(1, 2, 0)
    return Skin(
        np.ascontiguousarray((maps[..., :3] + 1) / 2),
        np.ascontiguousarray((maps[..., 6] + 1) / 2),
        np.zeros(maps.shape[:2], np.float32),
        np.ascontiguousarray(maps[..., 3:6]),
        np.ones(maps.shape[:2], bool),
    )


def _wear(skin: Skin, own: Skins, carried: Skins) -> Skin:
    """Give a subject another's colours where these are known, and its own, moved to that tone, elsewhere."""
    known = cv2.GaussianBlur(carried.known[1][0].float().numpy(), (0, 0), 6)[..., None]
    tone = (carried.tones[0] / own.tones[0]).numpy()
    diffuse = known * _skin(carried).diffuse + (1 - known) * skin.diffuse * tone
    return replace(skin, diffuse=np.clip(diffuse, 0, 1).astype(np.float32))
