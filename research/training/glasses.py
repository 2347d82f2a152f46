# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit the plane that tells glasses from bare faces (core/face/glasses.py), on photographs of synthetic people.

    python -m research.training glasses [--hdri FOLDER] [--figures 8] [--pictures 60] [--work FOLDER] [--out FILE]

Each figure's photographs come in pairs, one with glasses and one without; half of what is drawn is mirrored. Logistic
regression with a ridge. Minutes on one core and no internet; figures that are in the work folder already are not made
again.
"""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pycolmap
from scipy.optimize import minimize

from core.capture.files import replacing, write_json
from core.capture.messages import Reporter
from core.face import faces
from core.face.glasses import MOST_YAW_DEG, WEIGHTS, band, describe
from core.geometry import raster
from core.geometry.views import View

from ..people.environments import read_panoramas
from ..people.lifelike import glasses, unlit
from ..people.lifelike.figure import Figure, make_figure
from ..people.lifelike.snapshot import photograph
from .networks import OPTIONS, make_parser
from .seeds import held_out_seeds, training_seeds
from .sights import SightStore

FIRST_SEED, HELD_OUT = 3000, 4
VIEWS, SIZE, MARGIN, TEXELS = 6, 272, 1.6, 512
"""Of each figure, and of a view: its side in pixels and in sides of the face's landmarks; texels of a figure's maps."""
RIDGE = 0.1
LEAST_SPREAD = 1e-3
FAR_M = 9.0


@dataclass(frozen=True)
class BareSight:
    """A figure before there is light: depth [S, S] in metres, landmarks [468, 3] of the head."""

    unlit: unlit.Unlit
    depth: np.ndarray
    landmarks: np.ndarray
    view: View


@dataclass(frozen=True)
class Bands:
    """Pictures around the eyes, float32 [N, HEIGHT, WIDTH], with the true answer, bool [N]."""

    pictures: np.ndarray
    worn: np.ndarray


def main(arguments: list[str]) -> None:
    parser = make_parser("glasses", __doc__)
    parser.add_argument("--figures", type=int, default=8)
    parser.add_argument("--pictures", type=int, default=60, help="of each figure, every other one with glasses")
    parser.add_argument("--hdri", **OPTIONS["hdri"])
    parser.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "wildcap_glasses")
    parser.add_argument("--out", type=Path, default=WEIGHTS)
    print(json.dumps(train(**vars(parser.parse_args(arguments)))["held_out"], indent=1))


def train(figures: int, pictures: int, work: Path, out: Path, hdri: Path | None) -> dict:
    """Write the plane (.npz) and its card (.json). Returns the card."""
    learnt, held_out = seeds(figures)
    prepare(learnt + held_out, work, Reporter("train"))
    panoramas = read_panoramas(hdri)
    examples = draw(learnt, pictures, work, panoramas, 1)
    plane, offset = fit(np.array([describe(strip) for strip in examples.pictures]), examples.worn)
    tests = draw(held_out, pictures, work, panoramas, 2)
    worn = np.array([describe(strip) for strip in tests.pictures]) @ plane + offset > 0
    with replacing(out) as temporary:
        np.savez_compressed(temporary, plane=plane.astype(np.float32), offset=np.float32(offset))
    card = {
        "data": "Photographs of synthetic people (research/people/lifelike) on the built-in head, which derives from "
        "the MakeHuman base mesh (CC0), with and without drawn glasses; light from procedural environments and lamps"
        + (f" and {len(panoramas)} panoramas (CC0)" if panoramas else ""),
        "licence": "GPL-3.0-or-later",
        "command": f"python -m research.training glasses --figures {figures} --pictures {pictures}"
        + " --hdri hdri" * bool(panoramas),
        "seeds": learnt,
        "held_out_seeds": held_out,
        "pictures": len(examples.worn),
        "ridge": RIDGE,
        "held_out": {
            "what": "single photographs of held-out figures, share that is told to wear glasses",
            "pictures": len(tests.worn),
            "with_percent": round(100 * float(worn[tests.worn].mean()), 1),
            "without_percent": round(100 * float(worn[~tests.worn].mean()), 1),
        },
    }
    write_json(out.with_suffix(".json"), card)
    return card


def seeds(figures: int) -> tuple[list[int], list[int]]:
    """Return the seeds of the figures to learn from, and of the held-out ones."""
    return training_seeds(figures, FIRST_SEED), held_out_seeds(HELD_OUT)


def prepare(of: list[int], work: Path, report: Reporter) -> None:
    """Make the sights of these figures that the work folder lacks."""
    SightStore(work, "figure", VIEWS).prepare(of, make_sights, report)


def make_sights(store: SightStore, seed: int) -> None:
    """Trace the sights of one figure."""
    figure = make_figure(seed, TEXELS)
    scene = unlit.scene_of(figure, np.random.default_rng([seed, 90]))
    for number in range(VIEWS):
        rng, path = np.random.default_rng([seed, 94, number]), store.path(seed, number)
        view = _front_view(figure, rng)
        depth = raster.render_view(scene.whole, view)[2]
        path.parent.mkdir(parents=True, exist_ok=True)
        unlit.save(path.with_suffix(".unlit.npz"), unlit.trace_unlit(scene, view, rng, 1))
        with replacing(path) as temporary:
            np.savez_compressed(
                temporary,
                depth=depth.astype(np.float32),
                landmarks=unlit.landmarks_of(figure),
                translation=view.translation,
                params=view.camera.params,
            )


def read(work: Path, seed: int, number: int) -> BareSight:
    path = SightStore(work, "figure", VIEWS).path(seed, number)
    sight = unlit.load(path.with_suffix(".unlit.npz"))
    with np.load(path, allow_pickle=False) as stored:
        side = len(sight.albedo)
        camera = pycolmap.Camera(model="PINHOLE", width=side, height=side, params=stored["params"].tolist())
        view = View("", Path(), camera, sight.rotation.astype(np.float64), stored["translation"], True)
        depth = np.where(np.isfinite(stored["depth"]), stored["depth"], FAR_M)
        return BareSight(sight, depth, stored["landmarks"], view)


def photograph_sight(
    sight: BareSight, pair: glasses.Glasses | None, rng: np.random.Generator, panoramas: list[np.ndarray] = ()
) -> np.ndarray:
    """Take a photograph sRGB [S, S, 3] of a sight, with a pair of glasses as it sits on that head or without."""

    def put_on(radiance: np.ndarray, light: float) -> np.ndarray:
        return glasses.put_on(radiance, sight.view, sight.depth, pair, light, rng) if pair else radiance

    return _degrade(photograph(sight.unlit, rng, panoramas, put_on)[0], rng)


def draw(of: list[int], pictures: int, work: Path, panoramas: list[np.ndarray], salt: int) -> Bands:
    """Draw the bands of those photographs in which the net finds the face; another `salt` gives other photographs."""
    rows: list[tuple] = []
    for seed in of:
        for number in range(pictures):
            rng = np.random.default_rng([salt, seed, number])
            sight = read(work, seed, number // 2 % VIEWS)
            pair = glasses.sample_glasses(sight.landmarks, rng) if number % 2 else None
            srgb = photograph_sight(sight, pair, rng, panoramas)
            face = faces.detect(srgb)
            if face is not None and abs(face.yaw_deg) <= MOST_YAW_DEG:
                rows.append((band(srgb, face.landmarks), pair is not None))
    return Bands(*(np.array(column) for column in zip(*rows, strict=True)))


def fit(described: np.ndarray, worn: np.ndarray) -> tuple[np.ndarray, float]:
    """Fit the plane [D] and its offset, which give the logarithm of the odds of described [N, D]."""
    sign, middle = np.where(worn, 1.0, -1.0), described.mean(0)
    spread = (described.std(0) + LEAST_SPREAD) * np.sqrt(described.shape[1])
    described = (described - middle) / spread

    def cost(state: np.ndarray) -> tuple[float, np.ndarray]:
        margin = sign * (described @ state[:-1] + state[-1])
        pull = -sign / (1 + np.exp(np.clip(margin, -50, 50)))
        value = np.logaddexp(0, -margin).sum() + 0.5 * RIDGE * (state[:-1] ** 2).sum()
        return value, np.append(described.T @ pull + RIDGE * state[:-1], pull.sum())

    solution = minimize(cost, np.zeros(described.shape[1] + 1), jac=True, method="L-BFGS-B", options={"maxiter": 400}).x
    plane = solution[:-1] / spread
    return plane, float(solution[-1] - plane @ middle)


def _front_view(figure: Figure, rng: np.random.Generator) -> View:
    """Draw a view that shows both eyes."""
    while True:
        view = unlit.random_view(figure, rng, SIZE, MARGIN)
        if abs(np.degrees(np.arctan2(view.axis[0], view.axis[1]))) < MOST_YAW_DEG:
            return view


def _degrade(srgb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Add noise, take resolution and mirror, now and then."""
    if rng.random() < 0.3:
        noise = rng.normal(0, np.exp(rng.uniform(*np.log([0.004, 0.03]))), srgb.shape)
        srgb = np.clip(srgb + noise, 0, 1).astype(np.float32)
    if rng.random() < 0.3:
        small, side = round(len(srgb) / np.exp(rng.uniform(0.2, 1.0))), len(srgb)
        srgb = cv2.resize(cv2.resize(srgb, (small, small), interpolation=cv2.INTER_AREA), (side, side))
    return np.ascontiguousarray(srgb[:, ::-1]) if rng.random() < 0.5 else srgb
