# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Twelve real people relit hard: what a delighter makes of pictures whose albedo is known.

    python -m research.benchmarks.delighting.real_people LONDON HDRI [--weights FILE ...] [--json PATH] [--look FOLDER]

LONDON is the folder london_faces; the judges of research/people/london.py are relit under the panoramas of HDRI, which
no training has (hdri_extra), and lamps. Columns, natural log, root mean square over the face after one gain per
channel: the error of the log-albedo, of what is finer than an eighth of the face, and the disagreement between two
lights on the same sight; each as it is, and at the contrast that suits the answer best, which is one factor on the
log-albedo of all pictures. ± is the deviation over people. Of a network that states the size of its errors: the share
of the face, its brows and its eyes whose luminance is no further off. --look writes each picture, its truth and the
answers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from core.capture.messages import Problem
from core.face import faces, parser
from core.face.networks import read_network
from core.imaging import images
from core.imaging.normalized_convolution import weighted_blur
from core.settings.settings import DelightSettings
from core.stages.delight.evening import ShadingEstimate
from core.stages.delight.network import WEIGHTS, crop, divide, look_at, square_around
from core.stages.delight.photograph import delight_photograph
from core.stages.delight.unet import MIN_LINEAR, DelightNet, slice_grid
from core.stages.delight.unet import SIDE_PX as NETWORK_PX

from ...people import london, studio_people
from ...people.environments import read_panoramas
from ...people.olat import light_stage
from ...people.portrait import relight_sight
from .. import figures

COMMAND = "python -m research.benchmarks.delighting.real_people LONDON HDRI --json research/records/real_people.json"
SIDE_PX, SIGHTS = 512, 2
STRONG = 0.3  # least share of the lamps in the light of a picture: harder than most
FINE = 1 / 8  # of the face's width: the deviation of the blur that parts fine from coarse is half of it
COLUMNS = ("error", "fine", "between lights")


@dataclass(frozen=True)
class Sitting:
    """One sight of a person under two lights: srgb [2, S, S, 3]; albedo, linear [S, S, 3]; weight [2, S, S]."""

    person: str
    srgb: np.ndarray
    albedo: np.ndarray
    weight: np.ndarray


def main() -> None:
    line = figures.command_line(__doc__, "real_people")
    line.add_argument("london", type=Path)
    line.add_argument("hdri", type=Path)
    line.add_argument("--weights", type=Path, nargs="*", default=[], help="networks beside the shipped one")
    line.add_argument("--look", type=Path, help="folder that gets the pictures")
    options = line.parse_args()
    sittings = list(sit(options.london, options.hdri))
    answers = {"photograph": lambda srgb: srgb, "flat colour": _flat, "whole path": _whole_path}
    networks = {"network alone": WEIGHTS, **{f"{path.parent.name}/{path.stem} alone": path for path in options.weights}}
    networks = {name: read_network(DelightNet, path) for name, path in networks.items()}
    answers |= {name: _alone(net) for name, net in networks.items()}
    record, logs = {}, {}
    for name, answer in answers.items():
        logs[name] = [[_log(answer(srgb)) for srgb in sitting.srgb] for sitting in sittings]
        record[name] = measure(sittings, logs[name])
        print(f"{name:44}", row(record[name]), flush=True)
    for name, net in networks.items():
        if net.answers > 4:
            record[name] |= {"within": measure_sizes(sittings, net)}
            print(f"{name:44}", record[name]["within"])
    if options.look:
        _look(options.look, sittings, logs)
    figures.write_record(options.json, "real_people", COMMAND, record)


def sit(folder: Path, hdri: Path) -> Iterator[Sitting]:
    """Relight the judges; the studio's light is that of the others' photographs."""
    light = studio_people.fit_studio_light([studio_people.read_portrait(path) for path in london.photographs(folder)])
    panoramas = read_panoramas(hdri)
    for path in london.photographs(folder, judges=True):
        portrait, rng = studio_people.read_portrait(path), np.random.default_rng([int(path.name[:3]), 64])
        stage = light_stage(portrait.mesh)
        for sight in studio_people.sights(portrait, light, SIGHTS, SIDE_PX, rng):
            lit = []
            while len(lit) < 2:
                picture = relight_sight(sight, stage, rng, panoramas)
                if picture.strong > STRONG and faces.detect(picture.srgb) is not None:
                    lit.append(picture)
            yield Sitting(
                path.name[:3],
                np.stack([picture.srgb for picture in lit]),
                lit[0].albedo,
                np.stack([picture.face for picture in lit]),
            )


def measure(sittings: list[Sitting], logs: list[list[np.ndarray]]) -> dict:
    """Return the three errors of answers, natural log [S, S, 3] by sitting and light: at their own and best contrast.

    Column -> {value, best, deviation over people of best}; and the best contrast."""
    truths = [_log(images.linear_to_srgb(sitting.albedo)) for sitting in sittings]
    fine = [np.ptp(np.flatnonzero(sitting.weight[0].max(0) > 0.5)) * FINE / 2 for sitting in sittings]
    pairs = [
        (_centred(answer, weight), _centred(truth, weight), weight, sigma)
        for sitting, truth, answers, sigma in zip(sittings, truths, logs, fine, strict=True)
        for answer, weight in zip(answers, sitting.weight, strict=True)
    ]
    own = sum((weight[..., None] * answer**2).sum() for answer, _, weight, _ in pairs)
    both = sum((weight[..., None] * answer * truth).sum() for answer, truth, weight, _ in pairs)
    contrast = float(both / own) if own > 1e-3 else 1.0
    result = {"contrast": round(contrast, 3)}
    people = sorted({sitting.person for sitting in sittings})
    for column in COLUMNS:
        found = {}
        for scale in (1.0, contrast):
            values = {person: [] for person in people}
            for k, sitting in enumerate(sittings):
                answers = pairs[2 * k : 2 * k + 2]
                if column == "between lights":
                    weight = np.minimum(*sitting.weight)
                    change = _centred(scale * (answers[0][0] - answers[1][0]), weight)
                    values[sitting.person].append(_size(change, weight))
                    continue
                for answer, truth, weight, sigma in answers:
                    error = scale * answer - truth
                    if column == "fine":
                        error = error - weighted_blur(error, weight, sigma)
                    values[sitting.person].append(_size(error, weight))
            found[scale] = [float(np.mean(values[person])) for person in people]
        result[column] = {
            "value": round(float(np.mean(found[1.0])), 4),
            "best": round(float(np.mean(found[contrast])), 4),
            "deviation": round(float(np.std(found[contrast])), 4),
        }
    return result


def measure_sizes(sittings: list[Sitting], net: DelightNet) -> dict[str, float]:
    """Return the share of the errors of log-luminance within the size that a network states: face, brows, eyes."""
    within = {name: [] for name in ("face", "brows", "eyes")}
    for sitting in sittings:
        picture = images.linear_to_srgb(sitting.albedo)
        truth, face = _log(picture), faces.detect(picture)
        parts = parser.parse(picture, face.landmarks) if face else None
        for srgb, weight in zip(sitting.srgb, sitting.weight, strict=True):
            look = _look_at(net, srgb)
            error = _centred(_log(divide(srgb, look, 0 * look.shadow)[0]) - truth, weight).mean(-1)
            inside = np.abs(error) < _stated_size(look, srgb)
            shares = {"face": weight} | ({name: weight * parts.of(name) for name in ("brows", "eyes")} if parts else {})
            for name, share in shares.items():
                within[name].append((inside * share).sum() / max(share.sum(), 1e-6))
    return {name: round(float(np.mean(values)), 3) for name, values in within.items()}


def _stated_size(look: ShadingEstimate, srgb: np.ndarray) -> np.ndarray:
    """Return the size [S, S] of the errors that a look states, natural log; 1 off its square."""
    side = round(look.box[2])
    log = np.log(np.maximum(crop(images.srgb_to_linear(srgb), look.box, side), MIN_LINEAR))
    said = slice_grid(look.grid[:, 4:], torch.from_numpy(log.transpose(2, 0, 1))[None])[0, 0].exp().numpy()
    whole = np.ones(srgb.shape[:2], np.float32)
    left, top = (int(x) for x in look.box[:2])
    rows, columns = np.arange(len(whole)) - top, np.arange(whole.shape[1]) - left
    here_rows, here_columns = ((x >= 0) & (x < side) for x in (rows, columns))
    whole[np.ix_(here_rows, here_columns)] = said[np.ix_(rows[here_rows], columns[here_columns])]
    return whole


def row(measured: dict) -> str:
    """Format one answer's figures."""
    columns = [measured[name] for name in COLUMNS]
    cells = [f"{c['value']:.3f} -> {c['best']:.3f} ± {c['deviation']:.3f}" for c in columns]
    return " | ".join([*cells, f"contrast {measured['contrast']:.2f}"])


def _log(srgb: np.ndarray) -> np.ndarray:
    return np.log(np.maximum(images.srgb_to_linear(np.asarray(srgb, np.float32)), 4e-3))


def _centred(log: np.ndarray, weight: np.ndarray) -> np.ndarray:
    return log - (log * weight[..., None]).sum((0, 1)) / weight.sum()


def _size(error: np.ndarray, weight: np.ndarray) -> float:
    return float(np.sqrt((weight[..., None] * error**2).sum() / weight.sum() / 3))


def _flat(srgb: np.ndarray) -> np.ndarray:
    return np.full_like(srgb, 0.5)


def _whole_path(srgb: np.ndarray) -> np.ndarray:
    try:
        return delight_photograph(srgb, DelightSettings())[0]
    except Problem:
        return srgb


def _alone(net: DelightNet) -> Callable[[np.ndarray], np.ndarray]:
    """Return what a network makes of a photograph without a fitted head and without rules."""

    def answer(srgb: np.ndarray) -> np.ndarray:
        look = _look_at(net, srgb)
        return divide(srgb, look, np.zeros(look.shading.shape[:2], np.float32))[0]

    return answer


def _look_at(net: DelightNet, srgb: np.ndarray) -> ShadingEstimate:
    box = square_around(faces.detect(srgb).landmarks[:, :2])
    return look_at(net, box, crop(srgb, box, NETWORK_PX))


def _look(folder: Path, sittings: list[Sitting], logs: dict[str, list]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for k, sitting in enumerate(sittings):
        rows = []
        for light in range(2):
            answers = [images.linear_to_srgb(np.exp(log[k][light])) for log in logs.values()]
            known = np.repeat(sitting.weight[light][..., None], 3, -1)
            rows.append(np.hstack([images.linear_to_srgb(sitting.albedo), *answers, known]))
        images.write_srgb(folder / f"{k:02}_{sitting.person}.png", np.vstack(rows))


if __name__ == "__main__":
    main()
