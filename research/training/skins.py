# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Training data of the prior: synthetic skins, and skins of other heads that `carry` brought into our UVs.

A map is float16 [9, S, S]: 2 * diffuse_linear - 1 (3), tangent-space normal xyz (3), 2 * specular - 1 (1), and the
logarithms of the melanin and blood fractions that give this colour (2), by which `patches.draw` moves a skin's tone.
Carried skins have neither normal nor specular.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import torch
from scipy.ndimage import map_coordinates
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from core.capture.files import replacing
from core.capture.messages import Problem, Reporter
from core.face import template
from core.geometry import raster
from core.imaging import images

from ..people import light, pigment
from ..people.parameters import adorned, sample_parameters
from ..people.skin import make_skin

SIZE = 1024
SCALES = (1, 2, 4)
"""Sides of a texel in texels of the 1024 map; the solver goes through them from coarse to fine."""
NODES = 97  # per axis of the pigments that are tried for a colour
# colours per channel for which the nearest are looked up, evenly in the logarithm from here to 1
LEVELS, DARKEST = 40, 1e-3
FITTED = 256  # side at which baked shading is fitted
USUAL_BLOOD = 0.15  # how much a factor e of blood away from the usual fraction counts, in factors e of a channel
SAME_SKIN = 0.5  # correlation of fine detail from which two carried skins are one person's, painted over


@dataclass(frozen=True)
class Skins:
    """Skins at all scales.

    maps[scale]: float16 [9, SIZE / scale, SIZE / scale] per skin; known[scale]: bool [SIZE / scale, SIZE / scale] where
    a skin's diffuse can be learnt from, None if all of it and the other channels can; tones: linear RGB float32 [N, 3];
    names: seeds or file names.
    """

    maps: dict[int, list[torch.Tensor]]
    known: dict[int, list[torch.Tensor | None]]
    tones: torch.Tensor
    names: list[str]

    def __add__(self, other: Skins) -> Skins:
        return Skins(
            {s: self.maps[s] + other.maps[s] for s in SCALES},
            {s: self.known[s] + other.known[s] for s in SCALES},
            torch.cat([self.tones, other.tones]),
            self.names + other.names,
        )


def synthetic_skins(seeds: list[int], cache: Path, report: Reporter) -> Skins:
    """Return the synthetic skins of these seeds; those the cache lacks are made first (some seconds each)."""
    paths = []
    for i, seed in enumerate(seeds):
        path = cache / f"skin_{seed}_{SIZE}.npy"
        if not path.is_file():
            made = make_skin(adorned(sample_parameters(seed), seed), SIZE)
            store_maps(path, np.concatenate([2 * made.diffuse - 1, made.normal, 2 * made.specular[..., None] - 1], -1))
        paths.append(path)
        report.progress(i + 1, len(seeds), f"skin {i + 1} of {len(seeds)}")
    return _read(paths, [str(seed) for seed in seeds], None)


def carried_skins(folder: Path, names: list[str], mean: torch.Tensor, cache: Path, report: Reporter) -> Skins:
    """Return skins of a carried folder, without the shading that was baked into them.

    mean: [7, S, S] of `patches.mean_map`; cache: folder in which they are kept without shading.
    """
    paths = []
    for i, name in enumerate(names):
        source = folder / f"{name}.png"
        path = cache / f"carried_{name}_{hashlib.blake2b(source.read_bytes(), digest_size=6).hexdigest()}.npy"
        if not path.is_file():
            diffuse = unshaded(images.resize(images.read_linear(source), SIZE, SIZE), mean)
            blank = np.broadcast_to(np.float32([0, 0, 1, -0.3]), (SIZE, SIZE, 4))
            store_maps(path, np.concatenate([2 * diffuse - 1, blank], -1))
        paths.append(path)
        report.progress(i + 1, len(names), f"carried skin {name}")
    known = images.read_mask(folder / "known.png")
    return _read(paths, names, images.resize(known, SIZE, SIZE) * bare_face(SIZE) > 0.9)


def carried_names(folder: Path) -> list[str]:
    """Return the names of a carried folder's skins. Raises Problem if it is not one."""
    if not (folder / "carried.json").is_file():
        raise Problem(
            f"{folder} holds no carried skins.", "Make it with `python -m research.training carry FOLDER OUT`."
        )
    return sorted(path.stem for path in folder.glob("*.png") if path.stem != "known")


def clusters(folder: Path, names: list[str]) -> list[list[str]]:
    """Group names by person: fine detail that correlates is the same photographs painted over.

    A group is never split across training and test.
    """
    where = bare_face(512) > 0.5
    detail = []
    for name in names:
        grey = np.log(images.resize(images.read_linear(folder / f"{name}.png"), 512, 512).mean(-1) + 1e-3)
        fine = np.clip(cv2.GaussianBlur(grey, (0, 0), 1) - cv2.GaussianBlur(grey, (0, 0), 6), -0.3, 0.3)[where]
        detail.append((fine - fine.mean()) / np.linalg.norm(fine - fine.mean()))
    count, label = connected_components(np.array(detail) @ np.array(detail).T > SAME_SKIN)
    return [[name for name, its_label in zip(names, label, strict=True) if its_label == i] for i in range(count)]


def unshaded(diffuse: np.ndarray, mean: torch.Tensor) -> np.ndarray:
    """Divide a skin [S, S, 3] (linear) by the shading baked into it.

    It is that of the second-order sky, with the head's own occlusion, whose product with the mean face fits the skin's
    luminance best. What the fit cannot hold (paint, highlights) stays.
    """
    small = images.resize(diffuse, FITTED, FITTED).mean(-1)
    face = np.asarray(mean[:3].mean(0), np.float32)
    face = cv2.resize(face, (FITTED, FITTED), interpolation=cv2.INTER_AREA)
    basis, weight = _sky_basis(), bare_face(FITTED, "lips", "brows")
    columns = (basis * face).reshape(9, -1).astype(np.float64)
    w = weight.reshape(-1)
    for _ in range(3):  # robust: what is far off is paint or hair, not light
        matrix = (columns * w) @ columns.T
        coefficients = np.linalg.solve(
            matrix + 0.02 * np.trace(matrix) / 9 * np.diag([0.0] + [1.0] * 8), (columns * w) @ small.reshape(-1)
        )
        ratio = np.log(np.maximum(small.reshape(-1), 1e-3) / np.maximum(coefficients @ columns, 1e-3))
        w = weight.reshape(-1) / (1 + (ratio / 0.15) ** 2)
    shading = np.maximum(np.tensordot(coefficients, basis, 1), 1e-3)
    shading = np.clip(shading / np.average(shading, weights=weight), 0.4, 1.8).astype(np.float32)
    return np.clip(diffuse / cv2.resize(shading, diffuse.shape[1::-1], interpolation=cv2.INTER_CUBIC)[..., None], 0, 1)


def pigments(albedo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the logarithms of the melanin and blood fractions whose reflectance is nearest to an albedo.

    albedo: [..., 3], linear; each result: float32 [...].
    """
    level = (1 - np.log(np.clip(albedo, DARKEST, 1)) / np.log(DARKEST)) * (LEVELS - 1)
    return tuple(
        map_coordinates(table, level.reshape(-1, 3).T, order=1).reshape(albedo.shape[:-1]) for table in _pigment_table()
    )


def shrink(full: np.ndarray, scale: int) -> np.ndarray:
    """Average a map [C, S, S] over scale x scale texels; its normals are of length one again."""
    if scale == 1:
        return full
    side = full.shape[-1] // scale
    small = np.stack(
        [cv2.resize(channel.astype(np.float32), (side, side), interpolation=cv2.INTER_AREA) for channel in full]
    )
    small[3:6] /= np.maximum(np.linalg.norm(small[3:6], axis=0), 1e-6)
    return small.astype(full.dtype)


def store_maps(path: Path, maps: np.ndarray) -> None:
    """Write maps [S, S, 7] with their pigments as a file of `Skins.maps`."""
    logs = pigments((maps[..., :3] + 1) / 2)
    with replacing(path) as temporary:
        np.save(temporary, np.concatenate([maps, np.stack(logs, -1)], -1).transpose(2, 0, 1).astype(np.float16))


def _read(paths: list[Path], names: list[str], learnable: np.ndarray | None) -> Skins:
    maps: dict[int, list[torch.Tensor]] = {scale: [] for scale in SCALES}
    tones, skin = [], facial_skin(SIZE)
    for path in paths:
        full = np.load(path)
        for scale in SCALES:
            maps[scale].append(torch.from_numpy(shrink(full, scale)))
        tones.append(((full[:3].astype(np.float32) + 1) / 2 * skin).sum((1, 2)) / skin.sum())
    known = dict.fromkeys(SCALES, [None] * len(paths))
    if learnable is not None:
        for scale in SCALES:
            small = cv2.resize(learnable.astype(np.float32), (SIZE // scale,) * 2, interpolation=cv2.INTER_AREA)
            known[scale] = [torch.from_numpy(small > 0.99)] * len(paths)
    return Skins(maps, known, torch.from_numpy(np.reshape(tones, (-1, 3))).float(), names)


def facial_skin(size: int) -> np.ndarray:
    """Return the facial skin [S, S], in [0, 1]."""
    return template.mask("skin", size) * template.mask("face", size) * (1 - template.mask("eyes", size))


def bare_face(size: int, *more: str) -> np.ndarray:
    """Return the face [S, S] without eyes, scalp, ears, nostrils and `more` parts, in [0, 1].

    Nostrils are dark in every photograph.
    """
    covered = [template.mask(name, size) for name in ("eyes", "scalp", "ears", "nostrils", *more)]
    return template.mask("face", size) * np.prod([1 - mask for mask in covered], 0)


@cache
def _sky_basis() -> np.ndarray:
    """Return the shading [9, FITTED, FITTED] of each coefficient of the sky's radiance, with the head's occlusion."""
    head = template.load()
    face, bary = raster.rasterize_uv(head, FITTED)
    transfer = raster.interpolate(light.sky_transfer(), head.faces, face, bary)
    return raster.bleed(transfer, face >= 0).transpose(2, 0, 1).astype(np.float32)


@cache
def _pigment_table() -> tuple[np.ndarray, np.ndarray]:
    """Tabulate `pigments` of LEVELS colours per channel: float32 [LEVELS, LEVELS, LEVELS] each."""
    axes = (np.geomspace(*limits, NODES) for limits in (pigment.MELANIN_RANGE, pigment.BLOOD_RANGE))
    tried = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)
    logs = (1 - np.linspace(0, 1, LEVELS)) * np.log(DARKEST)
    colours = np.stack(np.meshgrid(logs, logs, logs, indexing="ij"), -1)
    known = np.log(pigment.reflectance(tried[:, 0], tried[:, 1]))
    # in dark skin blood hardly shows: of two that fit as well the usual one is taken
    unusual = USUAL_BLOOD * np.log(tried[:, 1:] / 0.02)
    colours = np.concatenate([colours, np.zeros((*colours.shape[:3], 1))], -1)
    _, nearest = cKDTree(np.hstack([known, unusual])).query(colours, eps=0.3)
    return tuple(np.log(tried).astype(np.float32)[nearest].transpose(3, 0, 1, 2))
