# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the plane by which glasses are told from bare faces (core/face/glasses.py), on photographs of synthetic people
with and without.

    python -m research.training glasses [--hdri FOLDER] [--figures 8] [--pictures 60] [--work FOLDER] [--out FILE]

Each figure's photographs come in pairs, one with glasses and one without; half of what is drawn is mirrored. Logistic
regression with a ridge. Minutes on one core and no internet; figures that are in the work folder already are not made
again.
"""

from __future__ import annotations

import argparse
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
from ..people.lifelike.figure import make_figure
from ..people.lifelike.snapshot import photograph
from .seeds import held_out_seeds, training_seeds

FIRST_SEED, HELD_OUT = 3000, 4
VIEWS, SIZE, MARGIN, TEXELS = 6, 272, 1.6, 512
"""Of each figure, and of a view: its side in pixels and in sides of the face's landmarks; texels of a figure's maps."""
RIDGE = 0.1
LEAST_SPREAD = 1e-3
FAR_M = 9.0


@dataclass(frozen=True)
class BareSight:
    """What a camera sees of a figure before there is light, how far away that is [S, S] in metres, and the head's
    landmarks [468, 3]."""

    unlit: unlit.Unlit
    depth: np.ndarray
    landmarks: np.ndarray
    view: View


@dataclass(frozen=True)
class Bands:
    """pictures float32 [N, HEIGHT, WIDTH] around the eyes; worn bool [N]; figure [N]: whose."""

    pictures: np.ndarray
    worn: np.ndarray
    figure: np.ndarray


def train(figures: int, pictures: int, work: Path, out: Path, hdri: Path | None, report: Reporter) -> dict:
    """Writes the plane and its card.

    Parameters
    ----------
    figures : number of those learnt from
    pictures : number of each figure's, every other one with glasses
    work : folder of the figures' sights
    out : .npz; its card is written beside it
    hdri : folder of panoramas that may light them
    report : hears of progress

    Returns
    -------
    The card.
    """
    learnt, held_out = seeds(figures)
    prepare(learnt + held_out, work, report)
    panoramas = read_panoramas(hdri)
    seen = draw(learnt, pictures, work, panoramas, 1)
    plane, offset = fit(np.array([describe(strip) for strip in seen.pictures]), seen.worn)
    judged = draw(held_out, pictures, work, panoramas, 2)
    told = np.array([describe(strip) for strip in judged.pictures]) @ plane + offset
    with replacing(out) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, plane=plane.astype(np.float32), offset=np.float32(offset))
    card = {
        "data": "Photographs of synthetic people (research/people/lifelike) on the built-in head, which derives from "
        "the MakeHuman base mesh (CC0), with and "
        "without drawn glasses; light from procedural environments and lamps"
        + (f" and {len(panoramas)} panoramas (CC0)" if panoramas else ""),
        "licence": "GPL-3.0-or-later",
        "command": f"python -m research.training glasses --figures {figures} --pictures {pictures}"
        + " --hdri hdri" * bool(panoramas),
        "seeds": learnt,
        "held_out_seeds": held_out,
        "pictures": len(seen.worn),
        "ridge": RIDGE,
        "held_out": {
            "what": "single photographs of held-out figures, share that is told to wear glasses",
            "pictures": len(judged.worn),
            "with_percent": round(100 * float((told[judged.worn] > 0).mean()), 1),
            "without_percent": round(100 * float((told[~judged.worn] > 0).mean()), 1),
        },
    }
    write_json(out.with_suffix(".json"), card)
    return card


def seeds(figures: int) -> tuple[list[int], list[int]]:
    """Who is learnt from and who is kept from it."""
    return training_seeds(figures, FIRST_SEED), held_out_seeds(HELD_OUT)


def prepare(of: list[int], work: Path, report: Reporter) -> None:
    """Makes the sights of these figures that the work folder lacks."""
    missing = [seed for seed in of if not _path(work, seed, VIEWS - 1).is_file()]
    for done, seed in enumerate(missing):
        report.progress(done, len(missing), f"figure {done + 1} of {len(missing)}")
        figure = make_figure(seed, TEXELS)
        scene = unlit.scene_of(figure, np.random.default_rng([seed, 90]))
        _path(work, seed, 0).parent.mkdir(parents=True, exist_ok=True)
        for number in range(VIEWS):
            rng = np.random.default_rng([seed, 94, number])
            view = _before(figure, rng)
            depth = raster.render_view(scene.whole, view)[2]
            unlit.save(_path(work, seed, number).with_suffix(".unlit.npz"), unlit.trace_unlit(scene, view, rng, 1))
            with replacing(_path(work, seed, number)) as temporary, open(temporary, "wb") as file:
                np.savez_compressed(
                    file,
                    depth=depth.astype(np.float32),
                    landmarks=unlit.landmarks_of(figure),
                    translation=view.translation,
                    params=view.camera.params,
                )


def read(work: Path, seed: int, number: int) -> BareSight:
    sight = unlit.load(_path(work, seed, number).with_suffix(".unlit.npz"))
    with np.load(_path(work, seed, number), allow_pickle=False) as stored:
        side = len(sight.albedo)
        camera = pycolmap.Camera(model="PINHOLE", width=side, height=side, params=stored["params"].tolist())
        view = View("", Path(), camera, sight.rotation.astype(np.float64), stored["translation"], True)
        depth = np.where(np.isfinite(stored["depth"]), stored["depth"], FAR_M)
        return BareSight(sight, depth, stored["landmarks"], view)


def photograph_sight(
    sight: BareSight, pair: glasses.Glasses | None, rng: np.random.Generator, panoramas: list[np.ndarray] = ()
) -> np.ndarray:
    """A photograph of a sight, with a pair of glasses or without.

    Parameters
    ----------
    sight : what is seen
    pair : as it sits on that head; None: none
    rng : of the light and the camera
    panoramas : as `read_panoramas` gives them; they may light it

    Returns
    -------
    sRGB [S, S, 3].
    """

    def worn(radiance: np.ndarray, light: float) -> np.ndarray:
        return glasses.put_on(radiance, sight.view, sight.depth, pair, light, rng) if pair else radiance

    return _spoilt(photograph(sight.unlit, rng, panoramas, worn)[0], rng)


def draw(of: list[int], pictures: int, work: Path, panoramas: list[np.ndarray], salt: int) -> Bands:
    """The bands of those photographs in which the net finds the face.

    Parameters
    ----------
    of : seeds of the figures
    pictures : number of each figure's, every other one with glasses
    work : folder of the figures' sights
    panoramas : as `read_panoramas` gives them; they may light it
    salt : part of each picture's seed; another gives other pictures
    """
    rows: list[tuple] = []
    for seed in of:
        for number in range(pictures):
            rng = np.random.default_rng([salt, seed, number])
            sight = read(work, seed, number // 2 % VIEWS)
            pair = glasses.sample_glasses(sight.landmarks, rng) if number % 2 else None
            srgb = photograph_sight(sight, pair, rng, panoramas)
            face = faces.detect(srgb)
            if face is not None and abs(face.yaw_deg) <= MOST_YAW_DEG:
                rows.append((band(srgb, face.landmarks), pair is not None, seed))
    return Bands(*(np.array(column) for column in zip(*rows, strict=True)))


def fit(described: np.ndarray, worn: np.ndarray, ridge: float = RIDGE) -> tuple[np.ndarray, float]:
    """The plane [D] and its offset: what they give of described [N, D] is the logarithm of the odds."""
    sign, middle, spread = (
        np.where(worn, 1.0, -1.0),
        described.mean(0),
        (described.std(0) + LEAST_SPREAD) * np.sqrt(described.shape[1]),
    )
    described = (described - middle) / spread

    def cost(state: np.ndarray) -> tuple[float, np.ndarray]:
        margin = sign * (described @ state[:-1] + state[-1])
        pull = -sign / (1 + np.exp(np.clip(margin, -50, 50)))
        value = np.logaddexp(0, -margin).sum() + 0.5 * ridge * (state[:-1] ** 2).sum()
        return value, np.append(described.T @ pull + ridge * state[:-1], pull.sum())

    solution = minimize(cost, np.zeros(described.shape[1] + 1), jac=True, method="L-BFGS-B", options={"maxiter": 400}).x
    plane = solution[:-1] / spread
    return plane, float(solution[-1] - plane @ middle)


def _before(figure, rng: np.random.Generator) -> View:
    """A view in which both eyes are seen."""
    while True:
        view = unlit.random_view(figure, rng, SIZE, MARGIN)
        if abs(np.degrees(np.arctan2(view.axis[0], view.axis[1]))) < MOST_YAW_DEG:
            return view


def _spoilt(srgb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Noise, less resolution and the mirror image, now and then."""
    if rng.random() < 0.3:
        srgb = np.clip(srgb + rng.normal(0, np.exp(rng.uniform(*np.log([0.004, 0.03]))), srgb.shape), 0, 1).astype(
            np.float32
        )
    if rng.random() < 0.3:
        small, side = round(len(srgb) / np.exp(rng.uniform(0.2, 1.0))), len(srgb)
        srgb = cv2.resize(cv2.resize(srgb, (small, small), interpolation=cv2.INTER_AREA), (side, side))
    return np.ascontiguousarray(srgb[:, ::-1]) if rng.random() < 0.5 else srgb


def _path(work: Path, seed: int, number: int) -> Path:
    return Path(work) / f"figure_{seed}" / f"{number}.npz"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m research.training glasses",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--figures", type=int, default=8)
    parser.add_argument("--pictures", type=int, default=60)
    parser.add_argument(
        "--hdri", type=Path, metavar="FOLDER", help="panoramas whose licence lets weights trained with them be shipped"
    )
    parser.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "wildcap_glasses")
    parser.add_argument("--out", type=Path, default=WEIGHTS)
    print(json.dumps(train(**vars(parser.parse_args(arguments)), report=Reporter("train"))["held_out"], indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
