# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The reflectance maps a prior learns from: a synthetic light stage, and skins of other heads that `train carry`
brought into our UVs.

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
"""Sides of a texel in texels of the 1024 map; the solver goes from coarse to fine over them."""
NODES = 97  # per axis of the pigments that are tried for a colour
# colours per channel for which the nearest are looked up, evenly in the logarithm from here to 1
LEVELS, DARKEST = 40, 1e-3
FITTED = 256  # side at which baked shading is fitted
USUAL_BLOOD = 0.15  # how much a factor e of blood away from the usual fraction counts, in factors e of a channel
SAME_SKIN = 0.5  # correlation of fine detail from which two carried skins are one person's, painted over


@dataclass(frozen=True)
class Skins:
    """maps[scale]: float16 [9, SIZE / scale, SIZE / scale] per skin; known[scale]: bool [SIZE / scale, SIZE / scale]
    where a skin's diffuse can be learnt from, None where all of it and the other channels can; tones: linear RGB
    float32 [N, 3]; names: seeds or file names."""

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
    """The synthetic skins of these seeds; those the cache lacks are made first (some seconds each)."""
    paths = []
    for i, seed in enumerate(seeds):
        path = Path(cache) / f"skin_{seed}_{SIZE}.npy"
        if not path.is_file():
            made = make_skin(adorned(sample_parameters(seed), seed), SIZE)
            _store(path, np.concatenate([2 * made.diffuse - 1, made.normal, 2 * made.specular[..., None] - 1], -1))
        paths.append(path)
        report.progress(i + 1, len(seeds), f"skin {i + 1} of {len(seeds)}")
    return _read(paths, [str(seed) for seed in seeds], None)


def carried_skins(folder: Path, names: list[str], mean: torch.Tensor, cache: Path, report: Reporter) -> Skins:
    """Skins that `train carry` brought into our UVs, without the shading that was baked into them.

    Parameters
    ----------
    folder : of NAME.png (sRGB) and known.png
    names : of the skins
    mean : [7, S, S], the mean face as `patches.mean_map` makes it
    cache : folder in which they are kept without shading
    report : hears of progress
    """
    paths = []
    for i, name in enumerate(names):
        source = Path(folder) / f"{name}.png"
        path = Path(cache) / f"carried_{name}_{hashlib.blake2b(source.read_bytes(), digest_size=6).hexdigest()}.npy"
        if not path.is_file():
            diffuse = unshaded(images.resize(images.read_linear(source), SIZE, SIZE), mean)
            blank = np.broadcast_to(np.float32([0, 0, 1, -0.3]), (SIZE, SIZE, 4))
            _store(path, np.concatenate([2 * diffuse - 1, blank], -1))
        paths.append(path)
        report.progress(i + 1, len(names), f"carried skin {name}")
    known = images.read_mask(Path(folder) / "known.png")
    return _read(paths, names, images.resize(known, SIZE, SIZE) * _bare(SIZE) > 0.9)


def carried_names(folder: Path) -> list[str]:
    """The skins of a carried folder. Raises Problem where it is none."""
    if not (Path(folder) / "carried.json").is_file():
        raise Problem(
            f"{folder} holds no carried skins.", "Make it with `python -m research.training carry FOLDER OUT`."
        )
    return sorted(path.stem for path in Path(folder).glob("*.png") if path.stem != "known")


def clusters(folder: Path, names: list[str]) -> list[list[str]]:
    """Names grouped by whose skin they are: fine detail that correlates is the same photographs painted over. Never
    split one across training and test."""
    where = _bare(512) > 0.5
    detail = []
    for name in names:
        grey = np.log(images.resize(images.read_linear(Path(folder) / f"{name}.png"), 512, 512).mean(-1) + 1e-3)
        fine = np.clip(cv2.GaussianBlur(grey, (0, 0), 1) - cv2.GaussianBlur(grey, (0, 0), 6), -0.3, 0.3)[where]
        detail.append((fine - fine.mean()) / np.linalg.norm(fine - fine.mean()))
    alike = np.array(detail) @ np.array(detail).T > SAME_SKIN
    for _ in names:  # whoever is like someone like them
        alike = alike @ alike
    return [[names[k] for k in np.flatnonzero(row)] for i, row in enumerate(alike) if not row[:i].any()]


def unshaded(diffuse: np.ndarray, mean: torch.Tensor) -> np.ndarray:
    """A skin [S, S, 3] (linear) divided by the shading baked into it: that of the second-order sky, with the head's own
    occlusion, whose product with the mean face fits its luminance best. What the fit cannot hold (paint, highlights)
    stays."""
    small = images.resize(diffuse, FITTED, FITTED).mean(-1)
    face = np.asarray(mean[:3].mean(0), np.float32)
    face = cv2.resize(face, (FITTED, FITTED), interpolation=cv2.INTER_AREA)
    basis, weight = (
        _sky_basis(),
        _bare(FITTED) * (1 - template.mask("lips", FITTED)) * (1 - template.mask("brows", FITTED)),
    )
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
    """Logarithms of the melanin and blood fractions whose reflectance is about nearest to an albedo [..., 3] (linear),
    float32 [...] each."""
    level = (1 - np.log(np.clip(albedo, DARKEST, 1)) / np.log(DARKEST)) * (LEVELS - 1)
    return tuple(
        map_coordinates(table, level.reshape(-1, 3).T, order=1).reshape(albedo.shape[:-1]) for table in _pigment_table()
    )


def shrink(full: np.ndarray, scale: int) -> np.ndarray:
    """A map [C, S, S] averaged over scale x scale texels, its normals of length one again."""
    if scale == 1:
        return full
    side = full.shape[-1] // scale
    small = np.stack(
        [cv2.resize(channel.astype(np.float32), (side, side), interpolation=cv2.INTER_AREA) for channel in full]
    )
    small[3:6] /= np.maximum(np.linalg.norm(small[3:6], axis=0), 1e-6)
    return small.astype(full.dtype)


def _store(path: Path, maps: np.ndarray) -> None:
    """Writes maps [S, S, 7] with their pigments as a file of `Skins.maps`."""
    logs = pigments((maps[..., :3] + 1) / 2)
    with replacing(path) as temporary, open(temporary, "wb") as file:
        np.save(file, np.concatenate([maps, np.stack(logs, -1)], -1).transpose(2, 0, 1).astype(np.float16))


def _read(paths: list[Path], names: list[str], learnable: np.ndarray | None) -> Skins:
    maps: dict[int, list[torch.Tensor]] = {scale: [] for scale in SCALES}
    tones, skin = [], template.mask("skin", SIZE) * template.mask("face", SIZE) * (1 - template.mask("eyes", SIZE))
    for path in paths:
        full = np.load(path)
        for scale in SCALES:
            maps[scale].append(torch.from_numpy(shrink(full, scale)))
        tones.append(((full[:3].astype(np.float32) + 1) / 2 * skin).sum((1, 2)) / skin.sum())
    areas = {
        scale: None
        if learnable is None
        else torch.from_numpy(
            cv2.resize(learnable.astype(np.float32), (SIZE // scale,) * 2, interpolation=cv2.INTER_AREA) > 0.99
        )
        for scale in SCALES
    }
    tones = torch.from_numpy(np.stack(tones)).float() if tones else torch.zeros(0, 3)
    return Skins(maps, {scale: [areas[scale]] * len(paths) for scale in SCALES}, tones, names)


def _bare(size: int) -> np.ndarray:
    """The face [S, S] without what is another's: eyes, scalp, ears, and the nostrils, which are dark in every
    photograph."""
    covered = [template.mask(name, size) for name in ("eyes", "scalp", "ears", "nostrils")]
    return template.mask("face", size) * np.prod([1 - mask for mask in covered], 0)


@cache
def _sky_basis() -> np.ndarray:
    """Shading [9, FITTED, FITTED] of each coefficient of the sky's radiance on the built-in head, with its
    occlusion."""
    head = template.load()
    face, bary = raster.rasterize_uv(head, FITTED)
    return (
        raster.bleed(raster.interpolate(light.sky_transfer(), head.faces, face, bary), face >= 0)
        .transpose(2, 0, 1)
        .astype(np.float32)
    )


@cache
def _pigment_table() -> tuple[np.ndarray, np.ndarray]:
    """`pigments` of LEVELS colours per channel: float32 [LEVELS, LEVELS, LEVELS] each."""
    tried = np.stack(
        np.meshgrid(
            *(np.geomspace(*limits, NODES) for limits in (pigment.MELANIN_RANGE, pigment.BLOOD_RANGE)), indexing="ij"
        ),
        -1,
    ).reshape(-1, 2)
    logs = (1 - np.linspace(0, 1, LEVELS)) * np.log(DARKEST)
    colours = np.stack(np.meshgrid(logs, logs, logs, indexing="ij"), -1)
    known = np.log(pigment.reflectance(tried[:, 0], tried[:, 1]))
    # in dark skin blood hardly shows: of two that fit as well the usual one is taken
    unusual = USUAL_BLOOD * np.log(tried[:, 1:] / 0.02)
    _, nearest = cKDTree(np.hstack([known, unusual])).query(
        np.concatenate([colours, np.zeros((*colours.shape[:3], 1))], -1), eps=0.3
    )
    return tuple(np.log(tried).astype(np.float32)[nearest].transpose(3, 0, 1, 2))
