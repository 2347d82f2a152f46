# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures a delighter learns from: subjects on the light stage seen from many sides, lit anew for every step.

What light does not change is made once per subject and kept in a work folder: sights and the stage's visibility (some
seconds each).
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
import torch
from safetensors.torch import load_file
from torch.nn import functional

from core.capture.files import replacing
from core.capture.messages import Reporter
from core.geometry.meshes import vertex_normals
from core.imaging import images
from core.stages.delight.unet import FARTHEST_LOG, SIDE_PX, network_input
from core.stages.solve.prior_files import WEIGHTS

from ..people import sight
from ..people.environments import read_panoramas
from ..people.identities import subject_mesh
from ..people.lifelike.markings import moles, stains, tufts
from ..people.olat import LightStage, light_stage
from ..people.portrait import Portrait, relight_sight, sample_sight
from ..people.skin import Skin
from .skins import Skins, carried_skins, synthetic_skins

WITH_GEOMETRY = 0.55
"""Share of the pictures whose geometry the network is told; single photographs have none."""
SLIP_PX = 0.8, 2.0
"""How far the head lies off its picture, in pixels of the network's square (standard deviation along each axis): one
registered to a film, and one fitted to the landmarks of a single photograph."""
FROM_LANDMARKS = 0.4  # share of the latter
LEAST = 0.01  # shading of which the logarithm is learnt; below is noise
LEAST_WEIGHT = 0.25  # of what is no skin, beside skin's 1
CARRIED = 0.35
"""Share of the subjects that wear a carried skin, where there are any."""


@dataclass(frozen=True)
class PortraitBatch:
    """layers [N, CHANNELS, SIDE, SIDE]; at half the size: shading [N, 3, ...] the true log-shading less the picture's
    middle, weight [N, 1, ...] of its error, shadow [N, 1, ...] and shadow_weight [N, 1, ...]. 2 k and 2 k + 1 are the
    same sight under two lights."""

    layers: torch.Tensor
    shading: torch.Tensor
    weight: torch.Tensor
    shadow: torch.Tensor
    shadow_weight: torch.Tensor


def prepare(
    seeds: list[int],
    views: int,
    work: Path,
    report: Reporter,
    skins: Path | None = None,
    names: list[str] = (),
    processes: int = 2,
) -> None:
    """Makes the sights of these subjects that the work folder lacks.

    Parameters
    ----------
    seeds : the subjects
    views : sights of each
    work : folder in which they are kept
    report : hears of progress
    skins : folder of carried skins
    names : those of them that some subjects wear
    processes : that make them; 1: this one
    """
    missing = [seed for seed in seeds if not (work / f"subject_{seed}" / f"{views - 1}.npz").is_file()]
    jobs = [(seed, views, work, skins, list(names)) for seed in missing]
    if processes < 2:
        for i, job in enumerate(jobs):
            _prepare_one(job)
            report.progress(i + 1, len(jobs), f"subject {i + 1} of {len(jobs)}")
        return
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        for i, _ in enumerate(pool.map(_prepare_one, jobs)):
            report.progress(i + 1, len(jobs), f"subject {i + 1} of {len(jobs)}")


class Portraits:
    """Draws batches of the prepared subjects."""

    def __init__(self, seeds: list[int], views: int, work: Path, panoramas: Path | None):
        self.seeds, self.views, self.work = seeds, views, work
        self.panoramas = read_panoramas(panoramas)
        self.heads: dict[int, LightStage] = {}

    def draw(self, pairs: int, rng: np.random.Generator, augment: bool = True) -> PortraitBatch:
        """`pairs` sights under two lights each."""
        return stacked(
            [make_example(portrait, geometry, rng) for portrait, geometry in self.portraits(pairs, rng, augment)]
        )

    def portraits(self, pairs: int, rng: np.random.Generator, augment: bool):
        for _ in range(pairs):
            seed, view = self.seeds[rng.integers(len(self.seeds))], int(rng.integers(self.views))
            seen = sight.full(sight.load(self.work / f"subject_{seed}" / f"{view}.npz"))
            albedo = seen.albedo
            if augment:  # other tones than the subjects' own
                albedo = np.clip(albedo * np.exp(rng.normal(0, 0.12) + rng.normal(0, 0.04, 3)), 0.003, 0.9).astype(
                    np.float32
                )
            for _ in range(2):
                lit = relight_sight(seen, self._stage(seed), rng, self.panoramas, albedo)
                parts = (
                    lit.fitted.ambient,
                    lit.fitted.sunlit,
                    lit.fitted.normal @ seen.rotation.T.astype(np.float32),
                    np.ones(len(seen.pixel), np.float32),
                )
                yield lit, tuple(seen.picture(pixels) for pixels in parts)

    def _stage(self, seed: int) -> LightStage:
        if seed not in self.heads:
            bits = np.load(self.work / f"subject_{seed}" / "visible.npy")
            mesh = subject_mesh(seed)
            self.heads[seed] = LightStage(
                mesh, vertex_normals(mesh).astype(np.float32), np.unpackbits(bits, axis=1).astype(bool)
            )
        return self.heads[seed]


def stacked(examples: list[tuple[np.ndarray, ...]]) -> PortraitBatch:
    """Examples as one batch, in their order."""
    return PortraitBatch(*(torch.from_numpy(np.stack(arrays)) for arrays in zip(*examples, strict=True)))


def make_example(
    portrait: Portrait, geometry_maps: tuple[np.ndarray, ...], rng: np.random.Generator
) -> tuple[np.ndarray, ...]:
    """What a batch holds of a portrait. geometry_maps: ambient, sunlit and normal [S, S, 3] (camera coordinates) of the
    registered head, and where it is [S, S]."""
    geometry = ()
    if rng.random() < WITH_GEOMETRY:
        off = SLIP_PX[int(rng.random() < FROM_LANDMARKS)]
        slip = np.float32([[1, 0, rng.normal(0, off)], [0, 1, rng.normal(0, off)]])
        geometry = [
            cv2.warpAffine(np.ascontiguousarray(array, np.float32), slip, (len(array), len(array)))
            for array in geometry_maps
        ]
    layers, middle = network_input(portrait.srgb, *geometry)
    sure = (_half(portrait.head) > 0.99) & (_half(portrait.albedo).min(-1) > 0.002)
    shading = np.log(np.maximum(_half(portrait.even), LEAST)) - middle
    weight = sure * (LEAST_WEIGHT + (1 - LEAST_WEIGHT) * _half(portrait.skin))
    strong = portrait.strong
    trust = 1.0 if strong > 0.4 or strong < 0.1 else 0.3  # in between it is a matter of taste what is a shadow
    parts = (
        layers,
        shading.transpose(2, 0, 1),
        weight[None],
        _half(portrait.shadow)[None] * (strong > 0.2),
        (sure * trust)[None],
    )
    parts = [np.ascontiguousarray(array, np.float32) for array in parts]
    return tuple(parts)


def mirrored(batch: PortraitBatch) -> PortraitBatch:
    """Left and right exchanged; a normal's x changes its sign."""
    layers = batch.layers.flip(-1)  # a copy
    layers[:, 12] *= -1
    return replace(
        batch,
        layers=layers,
        **{name: getattr(batch, name).flip(-1) for name in ("shading", "weight", "shadow", "shadow_weight")},
    )


def repainted(batch: PortraitBatch, rng: np.random.Generator) -> PortraitBatch:
    """The same faces in the same light with other pigment: stains, moles and tufts are painted over their skin, on both
    pictures of a sight alike. The shading stays what it was, but for the picture's middle."""
    layers, shading, side = batch.layers.clone(), batch.shading.clone(), batch.layers.shape[-1]
    skin = ((batch.weight - LEAST_WEIGHT) / (1 - LEAST_WEIGHT)).clamp(0, 1)
    skin = functional.interpolate(skin, scale_factor=2, mode="bilinear").numpy()[:, 0, ..., None]
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
    return replace(batch, layers=layers, shading=shading)


def _paint(side: int, rng: np.random.Generator) -> np.ndarray:
    """What a skin is painted with, [side, side, 3] as logarithms."""
    face = np.array([[0.2, 0.2], [0.8, 0.85]]) * side  # about where it is in its square
    log = np.zeros((side, side, 3), np.float32)
    for make, odds in ((stains, 0.6), (moles, 0.5), (partial(tufts, landmarks=face), 0.5)):
        if rng.random() < odds:
            log += make(side, rng=rng)
    return log


def _half(picture: np.ndarray) -> np.ndarray:
    half = SIDE_PX // 2, SIDE_PX // 2
    return cv2.resize(np.ascontiguousarray(picture, np.float32), half, interpolation=cv2.INTER_AREA)


def _prepare_one(job: tuple) -> None:
    seed, views, work, folder, names = job
    cv2.setNumThreads(1)
    silent, rng = Reporter("train", emit=lambda message: None), np.random.default_rng([seed, 50])
    skins = synthetic_skins([seed], work, silent)
    skin = _skin(skins, 0)
    if names and rng.random() < CARRIED:
        mean = load_file(WEIGHTS)["mean_face"].float()
        skin = _wearing(skin, skins, carried_skins(folder, [str(rng.choice(names))], mean, work, silent))
    stage, place = light_stage(subject_mesh(seed)), work / f"subject_{seed}"
    place.mkdir(exist_ok=True)
    with replacing(place / "visible.npy") as temporary, open(temporary, "wb") as file:
        np.save(file, np.packbits(stage.visible, axis=1))
    for view in range(views):
        sight.save(place / f"{view}.npz", sample_sight(stage, skin, np.random.default_rng([seed, 51, view]), SIDE_PX))


def _skin(skins: Skins, index: int) -> Skin:
    """A map of `skins` as the generator's own type; height is not needed."""
    maps = skins.maps[1][index].float().numpy().transpose(1, 2, 0)
    return Skin(
        np.ascontiguousarray((maps[..., :3] + 1) / 2),
        np.ascontiguousarray((maps[..., 6] + 1) / 2),
        np.zeros(maps.shape[:2], np.float32),
        np.ascontiguousarray(maps[..., 3:6]),
        np.ones(maps.shape[:2], bool),
    )


def _wearing(skin: Skin, own: Skins, carried: Skins) -> Skin:
    """The subject with another's colours where these are known, and its own, moved to that tone, elsewhere."""
    known = cv2.GaussianBlur(carried.known[1][0].float().numpy(), (0, 0), 6)[..., None]
    tone = (carried.tones[0] / own.tones[0]).numpy()
    return replace(
        skin,
        diffuse=np.clip(known * _skin(carried, 0).diffuse + (1 - known) * skin.diffuse * tone, 0, 1).astype(np.float32),
    )
