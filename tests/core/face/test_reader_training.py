# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Training of the face parser and of the eye reader: better than a constant answer, the same weights after a kill."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch

from core.capture.messages import Reporter
from core.face import eye_reader, parser
from core.face.parser_network import ParseNet
from core.face.parts import PARTS
from research.training import descent, eyes, readers
from research.training import parser as parsing
from research.training.descent import Run
from research.training.networks import train
from research.training.sights import SightStore, Source
from tests.core.face.conftest import FIGURES, PARSER_VIEWS, TINY
from tests.fixtures.refused import refused

QUIET = Reporter("train", emit=lambda message: None)
READERS = {
    "parser": SimpleNamespace(training=parsing, load=parser.load, classes=PARTS, options={"views": PARSER_VIEWS}),
    "eyes": SimpleNamespace(training=eyes, load=eye_reader.load, classes=eye_reader.CLASSES, options={"poses": 1}),
}


@pytest.fixture(params=READERS)
def reader(request):
    return READERS[request.param]


def batch_of(reader, request, count: int):
    work = request.getfixturevalue("eyes_work" if reader.training is eyes else "parser_work")
    store = SightStore(work, "figure", reader.training.READER.count(reader.options))
    return readers.draw(Source(store, [FIGURES[0]], reader.training.shoot), count, 1, np.random.default_rng(0))[0]


def test_missing_weights_are_a_problem(reader, tmp_path):
    refused(lambda: reader.load(tmp_path / "missing.safetensors"), "weights")


def test_a_little_training_beats_the_best_constant_answer(reader, request):
    batch = batch_of(reader, request, 2)
    bias = torch.zeros(len(reader.classes), requires_grad=True)
    torch.manual_seed(0)
    network = ParseNet(**TINY, parts=len(reader.classes))
    values = []
    for model, parameters, rate in (
        (lambda layers: bias[None, :, None, None].expand(len(layers), -1, *layers.shape[2:]), [bias], 0.3),
        (network, network.parameters(), 1e-2),
    ):
        optimiser = torch.optim.AdamW(parameters, lr=rate, weight_decay=0)
        for _ in range(40):
            value = reader.training.READER.loss(model, batch)
            optimiser.zero_grad()
            value.backward()
            optimiser.step()
        values.append(value.item())
    assert values[1] < 0.6 * values[0]


def test_a_killed_training_continues_to_the_same_weights(reader, request, tmp_path, monkeypatch):
    options = reader.training.CONFIGS["cpu"]["training"] | {"batch": 1, "echo": 2, "figures": 1, "held_out": 1}
    options |= reader.options
    monkeypatch.setitem(reader.training.CONFIGS, "cpu", {"model": TINY, "training": options})
    ticks = iter(range(10**6))
    # a step takes 40 s by the training's clock
    monkeypatch.setattr(descent, "time", SimpleNamespace(monotonic=lambda: 40.0 * next(ticks)))
    work = request.getfixturevalue("eyes_work" if reader.training is eyes else "parser_work")
    loss, weights = readers.Reader.loss, []
    for kill in (None, 9):
        folder, steps = tmp_path / str(kill), []
        folder.mkdir()
        for figure in work.glob("figure_*"):
            (folder / figure.name).symlink_to(figure)

        def counted(self, network, batch, steps=steps, kill=kill):
            steps.append(1)
            if len(steps) == kill:
                raise KeyboardInterrupt
            return loss(self, network, batch)

        monkeypatch.setattr(readers.Reader, "loss", counted)
        run = Run("cpu", folder, folder / "out.safetensors", minutes=6)
        if kill:
            with pytest.raises(KeyboardInterrupt):
                train(reader.training.TRAINING, run, QUIET)
        card = train(reader.training.TRAINING, run, QUIET)
        weights.append({name: value.clone() for name, value in reader.load(run.out).state_dict().items()})
    assert card["steps"] == 9 and card["prepared"] == 1 and card["held_out"], card
    assert all(torch.equal(weights[0][name], weights[1][name]) for name in weights[0])
    other = SimpleNamespace(data={}, more={})
    refused(lambda: descent.resume(run, other, ParseNet(**TINY, parts=len(reader.classes))), "other data")
