# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What surrounds a head and lies on its skin, drawn once and taken anew for every picture of a training: environments,
what stands before a lamp, moles and tufts of hair. A processor takes longer to draw them than to learn from them."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, fields
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
import torch

from ..contract.files import replacing
from ..synthetic.environments import made_environment, panorama_environment, read_panoramas
from ..synthetic.light import in_the_way
from ..synthetic.people.markings import moles, tufts
from ..synthetic.unfolded import SIDE, landmarks_in_uv

REACH_M = 0.3
"""Half of the width of what stands before a lamp, about the middle of the head."""
LEAST_LOG, MOST_LOG = -2.5, 1.5
"""Between which the logarithms of markings are kept as bytes."""
PANORAMAS = 0.6
"""Share of the environments that are panoramas, where there are any."""


@dataclass(frozen=True)
class Props:
    """On one device. radiance float32 [E, LIGHTS, 3], linear, of mean luminance 1, and colour [E, 3]: what shines
    hardest in it as irradiance over pi, zeros for nothing; gobos uint8 [G, SIDE, SIDE] of 255: the share of a lamp's
    light that is taken away within REACH_M of the middle; moles, tufts uint8 [M, 3, SIDE, SIDE]: logarithms of factors
    of the albedo, LEAST_LOG to MOST_LOG."""

    radiance: torch.Tensor
    colour: torch.Tensor
    gobos: torch.Tensor
    moles: torch.Tensor
    tufts: torch.Tensor

    def to(self, device: str) -> Props:
        return Props(*(getattr(self, field.name).to(device) for field in fields(Props)))


def make_props(count: int, panoramas: Path | None, seed: int, processes: int) -> Props:
    """`count` gobos, as many moles and tufts, and ten times as many environments, some of a folder of panoramas."""
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        drawn = list(pool.map(partial(_draw, folder=panoramas), [[seed, 96, k] for k in range(count)]))
    return Props(*(torch.from_numpy(np.concatenate(arrays)) for arrays in zip(*drawn, strict=True)))


def save_props(path: Path, props: Props) -> None:
    with replacing(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **{field.name: getattr(props, field.name).numpy() for field in fields(Props)})


def load_props(path: Path) -> Props:
    with np.load(path, allow_pickle=False) as stored:
        return Props(**{field.name: torch.from_numpy(stored[field.name]) for field in fields(Props)})


def logarithm(kept: torch.Tensor) -> torch.Tensor:
    """Markings [...] that are kept as bytes, as natural logarithms."""
    return LEAST_LOG + kept.float() * ((MOST_LOG - LEAST_LOG) / 255)


def _draw(seed: list[int], folder: Path | None) -> tuple[np.ndarray, ...]:
    cv2.setNumThreads(1)
    rng, panoramas = np.random.default_rng(seed), read_panoramas(folder)
    around = [panorama_environment(panoramas[rng.integers(len(panoramas))], rng)
              if panoramas and rng.random() < PANORAMAS else made_environment(rng) for _ in range(10)]
    return (np.stack([each.radiance for each in around]), np.stack([each.colour for each in around]),
            _gobo(rng)[None], _kept(moles(SIDE, rng)), _kept(tufts(SIDE, landmarks_in_uv(SIDE), rng)))


def _gobo(rng: np.random.Generator) -> np.ndarray:
    """What leaves, blinds, an edge or scattered pieces take away, uint8 [SIDE, SIDE]."""
    radius, away = np.exp(rng.uniform(np.log(0.004), np.log(0.03))), rng.uniform(0.1, 0.8)
    blur = max(2 * away * radius, 4e-4)
    kind = str(rng.choice(["pieces", "pieces", "pieces", "leaves", "leaves", "blinds", "edge"]))
    if kind == "pieces":
        return _pieces(blur, rng)
    y, x = (np.mgrid[0:SIDE, 0:SIDE] + 0.5) / SIDE * 2 * REACH_M - REACH_M
    return np.round(255 * in_the_way(x, y, blur, kind, rng)).astype(np.uint8)


def _pieces(blur: float, rng: np.random.Generator) -> np.ndarray:
    """Single leaves, twigs and other things with corners, each far from the next: what is easily taken for pigment.
    Edges are `blur` metres wide."""
    drawn, texel = np.zeros((SIDE, SIDE), np.uint8), 2 * REACH_M / SIDE
    for _ in range(int(rng.integers(8, 60))):
        size = np.exp(rng.uniform(np.log(0.006), np.log(0.04))) / texel
        axes = size * np.array([1.0, np.exp(rng.uniform(np.log(0.15), 0))])
        angles, turn = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(3, 9))), rng.uniform(0, np.pi)
        points = np.stack([np.cos(angles), np.sin(angles)], -1) * axes
        points = points @ [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]] + rng.uniform(0, SIDE, 2)
        cv2.fillPoly(drawn, [np.round(16 * points).astype(np.int32)], 255, cv2.LINE_AA, 4)
    return cv2.GaussianBlur(drawn, (0, 0), max(0.3, blur / texel / 3.5))  # as wide as a ramp of that width


def _kept(log: np.ndarray) -> np.ndarray:
    share = (np.clip(log, LEAST_LOG, MOST_LOG) - LEAST_LOG) / (MOST_LOG - LEAST_LOG)
    return np.round(255 * share).astype(np.uint8).transpose(2, 0, 1)[None]
