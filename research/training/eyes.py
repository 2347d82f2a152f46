# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Trains the eye reader on photographs of synthetic people's eyes, whose whites and irises are known.

    python -m research.training eyes --config cpu|gpu [--minutes 40] [--hdri FOLDER] [--growing] [--work DIR]
    python -m research.training eyes --prepare [--config cpu|gpu] [--work DIR]      make the figures' sights and stop
    python -m research.training eyes --export [--work DIR] [--out FILE]             write the running training's
    averaged weights now

As `train parser`; figures mostly without hair, which takes most of a figure's time and seldom hangs over an eye.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import torch
from torch.nn import functional

from core.capture.messages import Reporter
from core.face.eye_reader import CLASSES, SIDE_PX, to_eye_crop
from core.face.parser_network import ParseNet, network_input
from core.face.parts import cut, inside

from ..people.environments import read_panoramas
from ..people.lifelike import eye_sights, unlit
from ..people.lifelike.figure import make_figure
from ..people.lifelike.person import sample_person
from . import command_line, descent
from .seeds import named_subjects, panorama_names
from .snapshots import Echoed, Jitter, export_parsing, jitter_crop, recipe_of, require_figures, spoilt

WEIGHTS = Path(__file__).resolve().parent.parent / "weights" / "eyes.safetensors"
_MODEL = {"widths": [32, 48, 64, 96], "depths": [1, 1, 1, 2]}
CONFIGS = {
    "cpu": {
        "model": _MODEL,
        "training": {
            "batch": 16,
            "echo": 3,
            "rate": 1.5e-3,
            "minutes": 40,
            "figures": 160,
            "poses": 3,
            "held_out": 6,
            "seed": 0,
            "workers": 1,
        },
    },
    "gpu": {
        "model": _MODEL,
        "training": {
            "batch": 64,
            "echo": 1,
            "rate": 3e-3,
            "minutes": 20,
            "figures": 640,
            "poses": 3,
            "held_out": 6,
            "seed": 0,
            "workers": 14,
        },
    },
}
VIEWS = 4
"""Sights of each pose of a figure's lids, half of them of the left eye."""
HAIRY = 0.25
"""Share of the figures that keep their hair."""
TEXELS = 512
JITTER = Jitter(0.07, 0.13, 7.0)
EDGE, REACH = 4.0, 5
"""What lies so many pixels of the crop from the ball counts so many times more: most of a crop is skin."""


def train_eyes(config: str, out: Path, report: Reporter, run: descent.TrainingRun) -> dict:
    """Trains the eye reader; preparation does not count into its minutes.

    Parameters
    ----------
    config : one of CONFIGS
    out : safetensors, fp16; its card is written beside it
    report : hears of progress
    run : minutes and folders; it always begins with random weights

    Returns
    -------
    The card.

    Raises
    ------
    Problem : where the work folder holds a training on other data, or, growing, none of its figures yet
    """
    work, t, device = descent.work_folder(run, "eyes"), CONFIGS[config]["training"], descent.device_of(config)
    data = named_subjects(t["figures"], t["held_out"]) | {"panoramas": panorama_names(run.hdri)}
    if not run.growing:
        prepare_figures(config, work, report)
    require_figures("eyes", data, lambda seed: is_prepared(seed, t["poses"], work), work)
    unseen = Eyes(data["held_out_seeds"], t["poses"], work, run.hdri).draw(
        32 * t["held_out"], 1, np.random.default_rng(1), augment=False
    )[0]
    torch.manual_seed(t["seed"])
    network = ParseNet(**CONFIGS[config]["model"], parts=len(CLASSES))
    state = descent.resumed(work, descent.beginning(config, data, network))
    objective = descent.Objective(
        Echoed(Eyes(data["seeds"], t["poses"], work, run.hdri), t),
        lambda batch, step, share: loss(network, batch, device),
        lambda average: measure_figures(average, config, unseen, device),
    )
    descent.descend(network, state, objective, recipe_of(t, run.minutes), work, device, report)
    return export(work, out)


def prepare_figures(config: str, work: Path, report: Reporter) -> None:
    """The sights of all figures, those of the held-out ones first."""
    cv2.setNumThreads(1)
    t = CONFIGS[config]["training"]
    named = named_subjects(t["figures"], t["held_out"])
    missing = [seed for seed in named["held_out_seeds"] + named["seeds"] if not is_prepared(seed, t["poses"], work)]
    for done, seed in enumerate(missing):
        report.progress(done, len(missing), f"figure {done + 1} of {len(missing)}")
        rng = np.random.default_rng([seed, 95])
        person = sample_person(seed)
        figure = make_figure(person if rng.random() < HAIRY else replace(person, hair="none", beard="none"), TEXELS)
        _path(work, seed, 0).parent.mkdir(parents=True, exist_ok=True)
        for pose in range(t["poses"]):
            scene = unlit.scene_of(eye_sights.with_other_lids(figure, rng), rng)
            for view in range(VIEWS):
                eye_sights.save(_path(work, seed, pose * VIEWS + view), eye_sights.see_eye(scene, view % 2 == 1, rng))


def is_prepared(seed: int, poses: int, work: Path) -> bool:
    return _path(work, seed, poses * VIEWS - 1).is_file()  # the last one is written last


class Eyes:
    """Draws batches of the figures that are prepared; what is prepared later is drawn from then on."""

    def __init__(self, seeds: list[int], poses: int, work: Path, panoramas: Path | None):
        self.seeds, self.poses, self.work = seeds, poses, work
        self.panoramas = read_panoramas(panoramas)

    def draw(self, count: int, echo: int, rng: np.random.Generator, augment: bool = True) -> list[tuple]:
        """Batches of the same photographs, cropped and spoilt in other ways.

        Parameters
        ----------
        count : N, crops of each batch
        echo : number of batches
        rng : of all of it
        augment : off: cropped as the eyes' corners say, and not spoilt

        Returns
        -------
        Of each batch layers [N, CHANNELS, SIDE_PX, SIDE_PX] and shares [N, len(CLASSES), SIDE_PX, SIDE_PX].
        """
        ready = [seed for seed in self.seeds if is_prepared(seed, self.poses, self.work)]
        batches: list[list[tuple]] = [[] for _ in range(echo)]
        for _ in range(count):
            path = _path(self.work, ready[rng.integers(len(ready))], int(rng.integers(self.poses * VIEWS)))
            sight = eye_sights.load(path)
            picture, ball = eye_sights.photograph_eye(sight, rng, self.panoramas)
            for batch in batches:
                batch.append(make_example(picture, ball, sight, rng, augment))
        return [tuple(torch.from_numpy(np.stack(arrays)) for arrays in zip(*batch, strict=True)) for batch in batches]


def make_example(
    picture: np.ndarray, ball: np.ndarray, sight: eye_sights.EyeSight, rng: np.random.Generator, augment: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """A photograph as the network sees it.

    Parameters
    ----------
    picture : sRGB [S, S, 3]
    ball : [S, S, 2] in [0, 1], shares of white and iris
    sight : of this eye
    rng : of the crop and the spoiling
    augment : whether there are any

    Returns
    -------
    Layers float32 [CHANNELS, SIDE_PX, SIDE_PX] and shares of the classes [len(CLASSES), SIDE_PX, SIDE_PX].
    """
    move = to_eye_crop(sight.corners, sight.left)
    if augment:
        move = jitter_crop(move, SIDE_PX, JITTER, rng)
    seen = cut(picture, move, SIDE_PX)
    if augment:
        seen = spoilt(seen, rng)
    shares = np.clip(cut(ball, move, SIDE_PX), 0, 1)
    shares = np.concatenate([1 - shares.sum(-1, keepdims=True), shares], -1)
    return (
        network_input(seen, inside(picture.shape, move, SIDE_PX)),
        np.ascontiguousarray(np.clip(shares, 0, 1).transpose(2, 0, 1), np.float32),
    )


def loss(network: ParseNet, batch: tuple, device: str) -> torch.Tensor:
    """The cross-entropy of the shares, of which pixels near the ball have more than their number."""
    layers, shares = batch
    with torch.autocast(device, torch.bfloat16, enabled=device == "cuda"):
        logits = network(layers.to(device, memory_format=torch.channels_last))
    shares = shares.to(device)
    wrong = -(shares * functional.log_softmax(logits, 1)).sum(1, keepdim=True)
    near = functional.max_pool2d(shares[:, 1:].sum(1, keepdim=True), 2 * REACH + 1, 1, REACH)
    weight = layers[:, -1:].to(device) * (1 + EDGE * near)
    return (wrong * weight).sum() / weight.sum().clamp_min(1)


@torch.no_grad()
def measure_figures(average: dict, config: str, batch: tuple, device: str) -> dict[str, float]:
    """The averaged network on photographs of held-out figures, where a class is what most of a pixel is.

    Parameters
    ----------
    average : its weights
    config : one of CONFIGS
    batch : as `Eyes.draw` gives it
    device : on which it runs

    Returns
    -------
    Intersection over union of the ball and of its iris.
    """
    network = ParseNet(**CONFIGS[config]["model"], parts=len(CLASSES))
    network.load_state_dict(average)
    network.to(device, memory_format=torch.channels_last).eval()
    predicted = torch.cat([network(chunk.to(device)).argmax(1).cpu() for chunk in batch[0].split(32)])
    true = batch[1].argmax(1)

    def overlap(a: torch.Tensor, b: torch.Tensor) -> float:
        return round(float((a & b).sum() / (a | b).sum().clamp_min(1)), 4)

    return {"ball": overlap(predicted > 0, true > 0), "iris": overlap(predicted == 2, true == 2)}


def export(work: Path, out: Path = WEIGHTS) -> dict:
    """The averaged weights of a training folder, with their card."""
    config = CONFIGS[descent.read_state(work)["config"]]
    words = (
        "synthetic people's eyes",
        "photographs of held-out figures' eyes: intersection over union of the ball and of the iris, "
        "where a class is what most of a pixel is",
    )
    return export_parsing(
        "eyes", work, out, config, words, lambda seed: is_prepared(seed, config["training"]["poses"], work)
    )


def _path(work: Path, seed: int, number: int) -> Path:
    return Path(work) / f"figure_{seed}" / f"{number}.npz"


def main(arguments: list[str] | None = None) -> int:
    options = command_line.make_parser("eyes", __doc__, CONFIGS, WEIGHTS)
    command_line.add_sights(options, "figures")
    return command_line.carry_out(options, arguments, train_eyes, export, prepare_figures)


if __name__ == "__main__":
    raise SystemExit(main())
